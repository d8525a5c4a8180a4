"""What the guide in docs/ has from the code: tables, what its examples print, drawings."""
