// An unfolding map and the grazing curve over it. `npm run types` writes api.d.ts from the service's document.
import createClient from "openapi-fetch";
import type { components, paths } from "./api.js";

type Job = components["schemas"]["Job"];
type Range = { start: number; stop: number; points: number };

const client = createClient<paths>({ baseUrl: process.env["GRAZEMAP_URL"] ?? "http://127.0.0.1:8000" });
const headers = { prefer: "wait=30" };

// Waits until a job has ended, and returns its result.
async function resultOf(job: Job) {
  while (job.status === "accepted" || job.status === "running") {
    await new Promise((resolve) => setTimeout(resolve, 1000));
    const { data, error } = await client.GET("/v1/jobs/{job_id}", { params: { path: { job_id: job.id } } });
    if (error) throw new Error(error.detail);
    job = data;
  }
  const { data, error } = await client.GET("/v1/jobs/{job_id}/result", { params: { path: { job_id: job.id } } });
  if (error) throw new Error(error.detail);
  if (typeof data === "string") throw new Error("a table, not JSON");
  return data;
}

const omega: Range = { start: 0.26, stop: 0.3, points: 24 };
const clearance: Range = { start: 1.3, stop: 2.1, points: 16 };
const submittedCurve = await client.POST("/v1/grazing-curves", {
  params: { header: headers },
  body: { axis: { vary: "omega", values: omega } },
});
const submittedMap = await client.POST("/v1/unfolding-maps", {
  params: { header: headers },
  body: { horizontal: { vary: "omega", values: omega }, vertical: { vary: "clearance", values: clearance } },
});
if (submittedCurve.error) throw new Error(submittedCurve.error.detail);
if (submittedMap.error) throw new Error(submittedMap.error.detail);

const curve = await resultOf(submittedCurve.data);
const map = await resultOf(submittedMap.data);
// the stops of a curve that has `clearance` are alike; an evicted result is answered with the job that computes it again
if (!("clearance" in curve) || curve.process !== "grazing-curves") throw new Error("not a curve of equal stops");
if (!("motions" in map) || map.process !== "unfolding-maps") throw new Error("not a map");
console.log(`${map.motions.length} motions; the curve ends at clearance ${curve.clearance.at(-1)}`);
