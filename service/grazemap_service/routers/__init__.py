"""The routers: processes, jobs, events, results, the service's description, and its pages."""
