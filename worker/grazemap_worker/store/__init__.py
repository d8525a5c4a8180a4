"""What lives in Redis: job records, tile ledger, progress, results. Used by service and worker."""
