# Two commands do it all: `make demo` and `make test`. Each sets up .venv on first use.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
export ROS_AUTOMATIC_DISCOVERY_RANGE = LOCALHOST
export FASTDDS_BUILTIN_TRANSPORTS ?= UDPv4
export ROS_PYTHON_CHECK_FIELDS = 1

.PHONY: help demo test test-slow test-oldest docs lint bench lock bench-lock clean
help:  ## show the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12

$(VENV)/.ready: requirements.lock setup.py setup.cfg
	@echo "== setting up $(VENV) from requirements.lock (ROS 2 Jazzy as wheels; a minute or two, once)"
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(0 if (3, 10) <= v < (3, 14) else \
	  f"Python {v.major}.{v.minor} given; the ROS 2 wheels need 3.10 to 3.13: make PYTHON=python3.12")'
	@$(PYTHON) -m venv $(VENV)
	@# The pip that comes with Python 3.11 takes half as long again.
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check pip==26.3 || true
	@# The lock is whole. With --no-deps pip installs just that; without, an older pip may look past it for a newer release.
	@# pip compiles file after file; compileall does it on all cores, without what is hardly ever imported.
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-compile --require-hashes -r requirements.lock
	@$(BIN)/python -m compileall -q -j 0 -x '/(tests?|sklearn|plotly|pip|setuptools|pygments|fontTools)/' $(VENV)/lib >/dev/null || true
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --use-pep517 -e .
	@touch $@ && echo "== ready"

demo: $(VENV)/.ready  ## simulate, identify live, record to MCAP, replay, compare
	@$(BIN)/ssi_ros demo

# Workers side by side: threads of linear algebra of each would only wait for those of the other.
test test-slow test-oldest: export OMP_NUM_THREADS = 1
# Nodes start some two hundred times: what is compiled once is kept, whatever the shell says of it.
test test-slow test-oldest: export PYTHONDONTWRITEBYTECODE =

# What runs by the clock comes last: then all that is compiled once is there, and loads nobody's nodes.
test: $(VENV)/.ready  ## all tests on up to four cores, then those that run by the clock
	@$(BIN)/python -m pytest test -m 'not by_the_clock and not slow' --numprocesses=logical --maxprocesses=4 --dist=loadfile \
	  --max-worker-restart=0
	@$(BIN)/python -m pytest test -m 'by_the_clock and not slow' --numprocesses=3 --dist=loadfile \
	  --max-worker-restart=0

test-slow: $(VENV)/.ready  ## an injection of every effect and other long ones, about 15 minutes on two cores
	@$(BIN)/python -m pytest test -m slow --numprocesses=logical --maxprocesses=4 --dist=worksteal

# What Ubuntu 24.04, that of ROS 2 Jazzy, has of the libraries that rosdep installs.
OLDEST = numpy==1.26.4 scipy==1.11.4 matplotlib==3.6.3 tqdm==4.66.2
test-oldest: requirements.lock  ## the tests that are not slow, beside the libraries of Ubuntu 24.04
	@$(MAKE) --no-print-directory VENV=.venv-oldest .venv-oldest/.ready
	@.venv-oldest/bin/python -m pip install --quiet --disable-pip-version-check --no-deps $(OLDEST)
	@$(MAKE) --no-print-directory VENV=.venv-oldest test

docs: $(VENV)/.ready  ## make the reference from the code, and the site in build/site
	@$(BIN)/python -m ssi_ros.ros.reference docs/reference >/dev/null
	@$(BIN)/ssi_ros effects --markdown > docs/effects.md
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "open build/site/index.html"

lint: $(VENV)/.ready  ## style only
	@$(BIN)/python -m pytest -q test/test_style.py test/test_architecture.py

bench: .venv-bench/.ready  ## compare with other packages; BENCH=--quick for two minutes
	@nice .venv-bench/bin/python -m validation.bench_peers $(BENCH)

.venv-bench/.ready: requirements-bench.lock
	@echo "== setting up .venv-bench from requirements-bench.lock (1.6 GB; a few minutes, once)"
	@$(PYTHON) -m venv .venv-bench
	@.venv-bench/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements-bench.lock
	@touch $@

lock:  ## compile requirements.lock anew (needs uv); names, versions and hashes only
	uv pip compile --quiet --no-config --universal --python-version 3.10 --no-emit-index-url \
	  --no-header --no-annotate --generate-hashes requirements.in -o requirements.lock

bench-lock:  ## the same for requirements-bench.lock
	uv pip compile --quiet --no-config --universal --python-version 3.10 --no-emit-index-url \
	  --no-header --no-annotate --generate-hashes requirements-bench.in -o requirements-bench.lock

clean:  ## remove what the targets made
	rm -rf $(VENV) .venv-bench .venv-oldest build install log demo .pytest_cache *.egg-info
