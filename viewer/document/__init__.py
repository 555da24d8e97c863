"""What belongs to a scan and a user would be sorry to lose: documents, recordings, replay."""
