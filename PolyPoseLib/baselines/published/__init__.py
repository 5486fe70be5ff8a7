"""The method as published: gmNCC of the whole warped CT, optimised by Adam."""
