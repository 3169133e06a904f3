"""Questions from outside and their replies: what may be sent, what comes back, and the server in between."""
