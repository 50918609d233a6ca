"""Opening what is scored: datasets of this project, and the files that other people's methods write."""
