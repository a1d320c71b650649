"""What the processes of the bench share, in memory, without waiting for one another."""
