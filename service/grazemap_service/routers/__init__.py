"""The routers: processes, jobs, events, results, what the service is, and its pages."""
