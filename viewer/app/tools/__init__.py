"""What is done with a picture: measuring, saving, recording, replaying, exporting."""
