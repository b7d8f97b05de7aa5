"""
The steps of friction and play between two points, which `joints.py` prepares.

Compiled by numba on first use and cached.
"""
from numba import njit
import numpy as np

from ssi_ros.model.hinge_steps import real_dot

SUBSTEPS = 10
SWEEPS = 4              # joints feel each other within a step


@njit(cache=True)
def follow(kind, size, stiffness, distance):
    """Return the force (n,) of one joint along a distance (n,)."""
    force = np.empty(len(distance))
    held, before = 0.0, distance[0]
    for i in range(len(distance)):
        if kind == 0:
            force[i] = stiffness * min(max(distance[i], -size), size)
        else:
            held = min(max(held + stiffness * (distance[i] - before), -size), size)
            force[i], before = -held, distance[i]
    return force


@njit(cache=True, fastmath=True)
def march(z, poles, drive, kick, distance, kinds, sizes, stiffness):
    """Step through the record; return the states and the forces of the joints at the samples."""
    count, n = drive.shape
    joints = len(kinds)
    states = np.empty((count, n), np.complex128)
    extra = np.zeros((count, joints))
    reach = np.zeros((joints, joints))
    for i in range(joints):
        for j in range(joints):
            reach[i, j] = real_dot(distance[i], kick[j])
    force, held, old = np.zeros(joints), np.zeros(joints), np.zeros(joints)
    z, ahead = z.copy(), z.copy()
    for i in range(joints):
        old[i] = real_dot(distance[i], z)
    middle, before, free = old.copy(), old.copy(), old.copy()
    for k in range(count):
        states[k] = z
        # a joint has not moved yet when a load jumps at a sample: its force is still the old one
        extra[k] = force
        for _ in range(SUBSTEPS):
            for s in range(n):
                ahead[s] = poles[s] * z[s] + drive[k, s]
            for i in range(joints):
                free[i] = real_dot(distance[i], ahead)
            for _ in range(SWEEPS if joints > 1 else 1):
                for i in range(joints):
                    there = free[i]
                    for j in range(joints):
                        if j != i:
                            there += reach[i, j] * force[j]
                    there, give = (old[i] + there) / 2, reach[i, i] / 2
                    if kinds[i] == 0:
                        inside = there / (1.0 - stiffness[i] * give)
                        force[i] = stiffness[i] * min(max(inside, -sizes[i]), sizes[i])
                    else:
                        tried = ((held[i] + stiffness[i] * (there - before[i]))
                                 / (1.0 + stiffness[i] * give))
                        force[i] = -min(max(tried, -sizes[i]), sizes[i])
                    middle[i] = there + give * force[i]
            for i in range(joints):
                held[i], before[i] = -force[i], middle[i]
                for s in range(n):
                    ahead[s] += kick[i, s] * force[i]
            z, ahead = ahead, z
            for i in range(joints):
                old[i] = real_dot(distance[i], z)
    return states, extra
