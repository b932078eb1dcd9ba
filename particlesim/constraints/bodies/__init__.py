"""Bodies ready to use: particles and the constraints that hold them, from points and meshes."""
