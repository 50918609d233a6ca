"""How the committed clips were made: motion capture of other skeletons brought onto SMPL's joints."""
