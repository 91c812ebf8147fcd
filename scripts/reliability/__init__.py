"""What holds when processes are killed, disks are full, and runs are long: measured, and written down."""
