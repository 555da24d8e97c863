"""What benchmarks draw: subjects by name, how they are sampled or scanned, and from where they are seen."""
