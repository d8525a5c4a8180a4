# An unfolding map and the grazing curve over it: julia unfolding_map.jl [SERVICE [PICTURE]]
using CSV, HTTP, JSON, Plots

const SERVICE = get(ARGS, 1, "http://127.0.0.1:8000")
const PICTURE = get(ARGS, 2, "map.png")

"Submit a request, wait until its job has ended, and return the address of the result."
function compute(process, request)
    headers = ["Content-Type" => "application/json", "Prefer" => "wait=30"]
    job = JSON.parse(String(HTTP.post("$SERVICE/v1/$process", headers, JSON.json(request)).body))
    while job["status"] in ("accepted", "running")
        sleep(1)
        job = JSON.parse(String(HTTP.get("$SERVICE/v1/jobs/$(job["id"])").body))
    end
    job["status"] == "successful" || error(job["problem"]["detail"])
    return "$SERVICE/v1/jobs/$(job["id"])/result"
end

omega = Dict("start" => 0.26, "stop" => 0.30, "points" => 24)
clearance = Dict("start" => 1.3, "stop" => 2.1, "points" => 16)
curve = JSON.parse(String(HTTP.get(compute("grazing-curves", Dict("omega" => omega))).body))
map_address = compute("unfolding-maps", Dict("omega" => omega, "clearance" => clearance))
points = CSV.File(HTTP.get("$map_address?f=csv").body)

scatter(points.omega, points.clearance; group = points.label, markershape = :square, markerstrokewidth = 0,
        xlabel = "omega", ylabel = "clearance", label = "")
plot!(Float64.(curve["omega"]), Float64.(curve["clearance"]); color = :black, linewidth = 2, label = "grazing")
savefig(PICTURE)
println(length(unique(points.label)), " motions; the curve ends at clearance ", curve["clearance"][end])
