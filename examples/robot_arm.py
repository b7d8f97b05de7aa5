"""
Simulate a robot arm with a flexible link in MuJoCo, and linearise it for a diagnosis.

`python examples/robot_arm.py arm.npz` writes the linearised model; with a folder and changes of
the arm after it, such as `real elbow.stiffness=0.96`, also a bag of the changed arm, with the
torques of its motors as recorded inputs. Needs `pip install mujoco`. Encoders of shoulder and
elbow, a gyroscope and an accelerometer at the tip.
"""
import sys

import mujoco
import numpy as np

from ssi_ros.model import Channel, Input, LinearModel, save_model, state_space_model
from ssi_ros.records import Samples

RATE_HZ, STEPS = 200.0, 5       # internal steps a sample, over which the torque is held
FINE_S = 2e-6                   # step of the linearised integrator
TORQUE_N_M = (0.6, 0.3)         # rms of the random torques
NOISE = (1e-3, 1e-3, 1e-3, 0.05)
ARM = """
<mujoco>
 <option timestep="1e-3" gravity="0 0 0" integrator="RK4"/>
 <worldbody><body name="upper">
  <joint name="shoulder" axis="0 0 1" stiffness="400" damping="2"/>
  <inertial pos=".25 0 0" mass="4" diaginertia=".01 .09 .09"/>
  <body name="fore" pos=".5 0 0">
   <joint name="elbow" axis="0 0 1" stiffness="300" damping=".6"/>
   <inertial pos=".15 0 0" mass="1.5" diaginertia=".002 .012 .012"/>
   <body name="link" pos=".3 0 0">
    <joint name="flex" axis="0 0 1" stiffness="250" damping=".08"/>
    <inertial pos=".15 0 0" mass=".8" diaginertia=".001 .006 .006"/>
    <body name="payload" pos=".3 0 0">
     <inertial pos="0 0 0" mass=".2" diaginertia="1e-6 1e-6 1e-6"/><site name="tip"/>
 </body></body></body></body></worldbody>
 <actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator>
 <sensor><jointvel joint="shoulder"/><jointvel joint="elbow"/>
  <gyro site="tip"/><accelerometer site="tip"/></sensor>
</mujoco>"""
READ = (0, 1, 4, 6)             # rates, z of the gyroscope, y of the accelerometer
JOINTS = ('shoulder', 'elbow', 'flex')


def arm(**changes):
    """Return the MjModel with factors such as elbow_stiffness=0.97 or payload_mass=1.1."""
    model = mujoco.MjModel.from_xml_string(ARM)
    for name, factor in changes.items():
        part, what = name.rsplit('_', 1)
        if what == 'mass':
            model.body_mass[model.body(part).id] *= factor
        elif what == 'stiffness':
            model.jnt_stiffness[model.joint(part).id] *= factor
        else:
            model.dof_damping[model.joint(part).dofadr[0]] *= factor
    return model


def names():
    """Return what both forms of the nominal model share."""
    channels = ('shoulder_rate', 'elbow_rate', 'tip_rate', 'tip_acc')
    kinds = ('angular_rate',) * 3 + ('acceleration',)
    return {'drives': tuple(map(Input, ('torque_shoulder', 'torque_elbow'), TORQUE_N_M)),
            'sensors': tuple(map(Channel, channels, kinds, NOISE)), 'rate_hz': RATE_HZ}


def state_space():
    """
    Return the LinearModel of MuJoCo's own finite differences, mjd_transitionFD.

    They do not know RK4. The speeds of the implicit integrator are half a step late, so the step
    is a short one.
    """
    model = arm()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.timestep = FINE_S
    steps = round(1 / (FINE_S * RATE_HZ))
    data = mujoco.MjData(model)
    n, m = 2 * model.nv, model.nu
    a, b, c, d = (np.zeros(s) for s in (
        (n, n), (n, m), (model.nsensordata, n), (model.nsensordata, m)))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, a, b, c, d)
    held = sum(np.linalg.matrix_power(a, i) @ b for i in range(steps))
    return state_space_model(np.linalg.matrix_power(a, steps), held, c[READ, :], d[READ, :],
                             discrete=True, **names())


def matrices():
    """Return the LinearModel of MuJoCo's mass matrix, joint springs and joint dampers."""
    model = arm()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    unit, mass = np.eye(model.nv), np.zeros((model.nv, model.nv))
    for i, row in enumerate(unit):
        column = np.zeros((1, model.nv))
        mujoco.mj_mulM(model, data, column[0], row)
        mass[i] = column[0]
    tip = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, tip, None, model.site('tip').id)
    output = np.vstack([unit[0], unit[1], np.ones(3), tip[1]])
    return LinearModel((mass + mass.T) / 2, np.diag(model.dof_damping),
                       np.diag(model.jnt_stiffness), input=unit[:, :2], output=output,
                       freedoms=JOINTS, **names())


def record(seconds, seed, gains=(1.0, 1.0, 1.0, 1.0), late=(0, 0, 0, 0), play=0.0, **changes):
    """
    Return Samples of the arm by MuJoCo's integrator under random torques, and of the torques.

    It has moved for ten seconds when they begin. Channels may have gains and be `late` by internal
    steps, and the spring of the elbow may have `play` to both sides [rad].
    """
    model = arm(**changes)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    lead = round(10 * RATE_HZ)          # until it moves as if for ever
    count = lead + round(seconds * RATE_HZ)
    torques = rng.standard_normal((count, model.nu)) * TORQUE_N_M
    values = np.empty((count * STEPS, len(READ)))
    elbow = model.joint('elbow').id

    def spring(model, data):
        angle = data.qpos[elbow]
        data.qfrc_passive[elbow] += model.jnt_stiffness[elbow] * np.clip(angle, -play, play)
    mujoco.set_mjcb_passive(spring if play else None)
    for i, row in enumerate(values):
        data.ctrl[:] = torques[i // STEPS]
        mujoco.mj_step(model, data)
        row[:] = data.sensordata[list(READ)]
    mujoco.set_mjcb_passive(None)
    values = np.column_stack([values[lead * STEPS - n::STEPS, i][:count - lead]
                              for i, n in enumerate(late)])
    values = values * gains + rng.standard_normal(values.shape) * NOISE
    return (Samples(values, RATE_HZ, tuple(s.name for s in names()['sensors'])),
            Samples(torques[lead:], RATE_HZ, tuple(d.name for d in names()['drives'])))


if __name__ == '__main__':
    save_model(matrices(), sys.argv[1])
    if len(sys.argv) > 2:
        from ssi_ros.bag import write_samples
        pairs = (word.split('=') for word in sys.argv[3:])
        samples, torques = record(300.0, 1, **{
            k.replace('.', '_'): float(v) for k, v in pairs})
        write_samples(sys.argv[2], samples, inputs=torques)
