"""The station's web server: page, WHEP, and what travels beside the video."""
