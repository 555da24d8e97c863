"""Drawing: what a request comes to, what it needs made beforehand, and the steps of one frame."""
