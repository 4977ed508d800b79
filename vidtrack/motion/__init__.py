"""From trajectories: velocity and acceleration, rigid bodies, lag behind another record."""
