"""What trajectories tell: velocity and acceleration, rigid bodies, lag behind another record."""
