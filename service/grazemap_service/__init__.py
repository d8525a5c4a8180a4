"""The HTTP front end: it validates, queues and answers; it never imports the core."""
