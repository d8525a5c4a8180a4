# An unfolding map and the grazing curve over it: Rscript unfolding_map.R [SERVICE [PICTURE]]
library(httr2)

arguments <- commandArgs(trailingOnly = TRUE)
service <- if (length(arguments) > 0) arguments[1] else "http://127.0.0.1:8000"
picture <- if (length(arguments) > 1) arguments[2] else "map.png"

# Submits a request, waits until its job has ended, and returns the address of the result.
compute <- function(process, body) {
  job <- request(service) |>
    req_url_path_append("v1", process) |>
    req_headers(Prefer = "wait=30") |>
    req_body_json(body) |>
    req_perform() |>
    resp_body_json()
  while (job$status %in% c("accepted", "running")) {
    Sys.sleep(1)
    job <- request(service) |> req_url_path_append("v1", "jobs", job$id) |> req_perform() |> resp_body_json()
  }
  if (job$status != "successful") stop(job$problem$detail)
  paste0(service, "/v1/jobs/", job$id, "/result")
}

omega <- list(start = 0.26, stop = 0.30, points = 24)
clearance <- list(start = 1.3, stop = 2.1, points = 16)
curve <- request(compute("grazing-curves", list(omega = omega))) |>
  req_perform() |>
  resp_body_json(simplifyVector = TRUE)
points <- read.csv(paste0(compute("unfolding-maps", list(omega = omega, clearance = clearance)), "?f=csv"))

png(picture)
motions <- factor(points$label)
plot(points$omega, points$clearance, col = motions, pch = 15, xlab = "omega", ylab = "clearance")
lines(curve$omega, curve$clearance, lwd = 2)
invisible(dev.off())
cat(nlevels(motions), "motions; the curve ends at clearance", format(tail(curve$clearance, 1), digits = 15), "\n")
