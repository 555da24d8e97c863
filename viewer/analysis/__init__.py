"""What is computed on a scan: functions without a window."""
