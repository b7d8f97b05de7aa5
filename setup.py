"""Build the ssi_ros package: for colcon on a ROS 2 machine, for pip elsewhere."""
from glob import glob
import sys

from setuptools import find_packages, setup

package_name = 'ssi_ros'
nodes = ('simulator', 'identifier', 'recorder', 'player', 'bridge', 'gap')
# `ros2 run` looks for executables in lib/ssi_ros, and setup.cfg puts all of them there; what a
# user types stands in bin, which colcon puts on the PATH. A wheel makes its own bin/ssi_ros.
is_wheel = {'bdist_wheel', 'editable_wheel', 'dist_info'} & set(sys.argv)
commands = [] if is_wheel else [('bin', ['scripts/ssi_ros'])]

setup(
    name=package_name,
    version='0.1.0',
    packages=find_packages(include=[package_name, package_name + '.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        ('share/' + package_name + '/config', glob('config/*.*')),
        ('share/' + package_name + '/launch', glob('launch/*.launch.py')),
        *commands,
    ],
    package_data={package_name + '.report': ['*.css', '*.js']},
    python_requires='>=3.10',
    install_requires=['numpy>=1.26', 'scipy>=1.11', 'numba', 'mcap', 'zstandard', 'pyyaml',
                      'threadpoolctl', 'tqdm', 'matplotlib', 'plotly'],
    extras_require={'complete': ['argcomplete'],
                    'see': ['textual', 'foxglove-sdk'],
                    'uff': ['pyuff'],
                    'many': ['dask', 'distributed', 'cryptography'],
                    'test': ['pytest', 'hypothesis', 'rosbags', 'mcap-ros2-support',
                             'websockets', 'mkdocs', 'mkdocs-material', 'math-core']},
    zip_safe=False,
    maintainer='ssi_ros maintainers',
    maintainer_email='maintainers@users.noreply.h-seed-61da63cb.example',
    description='Modal identification of flexible spacecraft by SSI-COV, live on ROS 2.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'ssi_ros = ssi_ros.cli.main:main',
            *[f'{node}_node = ssi_ros.ros.{node}_node:main' for node in nodes],
        ],
    },
)
