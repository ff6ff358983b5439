# Every target does the set-up it needs. Stamps under build/ keep repeats fast.
PY := .venv/bin/python
STAMPS := build/stamps
.DEFAULT_GOAL := setup
# Hundreds of processes start here; without compiled bytecode each of them compiles the package for half a second.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup native sanitized cabinet demo test test-fast test-computing test-ros test-ros2 test-ros1 test-pythons test-long mutants conformance lint check bench soak figures lock docs \
	wheel first-hour first-day clean help

##@ To try it

demo: native cabinet  ## motions on the virtual cabinet, a table and a plot; installs only what that needs
	.venv/bin/heptarm demo

# Only the packages of the demo; those of the tests come on top of them.
$(STAMPS)/demo: pyproject.toml scripts/setup.sh $(wildcard scripts/lock/demo.txt)
	scripts/setup.sh demo
	@mkdir -p $(STAMPS) && touch $@

##@ To build

setup: $(STAMPS)/venv native cabinet  ## everything for developers: virtual environment, package, tools, extension, compiled cabinet

$(STAMPS)/venv: $(STAMPS)/demo $(wildcard scripts/lock/dev.txt scripts/lock/torch.txt)
	scripts/setup.sh dev
	@mkdir -p $(STAMPS) && touch $@

# Its sources are few: the build system knows by itself whether one has changed.
native: $(STAMPS)/compiler  ## compile the extension heptarm._native
	@$(PY) scripts/native.py

$(STAMPS)/compiler: scripts/setup_compiler.sh $(STAMPS)/demo
	scripts/setup_compiler.sh
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/jdk: scripts/setup_jdk.py cabinet/toolchain.py $(STAMPS)/demo
	$(PY) scripts/setup_jdk.py
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/browser: scripts/setup_browser.sh
	scripts/setup_browser.sh
	@mkdir -p $(STAMPS) && touch $@

# Tests mostly wait for arms that move, and measure times: one processor is left for everything else.
WORKERS ?= $(shell n=$$(nproc 2>/dev/null || echo 2); if [ $$n -gt 7 ]; then echo 6; elif [ $$n -gt 3 ]; then expr $$n - 1; else echo 2; fi)
LONGEST := --durations=15 --durations-min=3
# To import all tests for those few takes twelve seconds.
ALONE = $(shell grep -rl 'mark\.alone' tests --include='test_*.py')
PARALLEL := -n $(WORKERS) --dist loadfile --no-loadscope-reorder
postpone = $(if $(POSTPONED),--postpone $(POSTPONED)/$(1))

ROS2_PACKAGES := $(shell find ros2/interfaces ros2/heptarm_msgs -type f)

$(STAMPS)/ros2: scripts/setup_ros2.sh scripts/ros2_interfaces.py scripts/ros2_requirements.txt $(wildcard scripts/lock/ros2.txt) $(ROS2_PACKAGES) $(STAMPS)/demo
	scripts/setup_ros2.sh
	@mkdir -p $(STAMPS) && if [ -x build/ros2/bin/python ]; then touch $@; fi  # asked again where there is none

ROS1_PACKAGES := $(shell find ros1/interfaces -type f)

$(STAMPS)/ros1: scripts/setup_ros1.sh scripts/ros1_interfaces.py $(wildcard scripts/lock/ros1.txt scripts/lock/numpy.txt) $(ROS1_PACKAGES) $(ROS2_PACKAGES) $(STAMPS)/demo
	scripts/setup_ros1.sh
	@mkdir -p $(STAMPS) && if [ -x build/ros1/bin/python ]; then touch $@; fi

cabinet: $(STAMPS)/jdk  ## compile the cabinet application and its doubles
	@$(PY) cabinet/build.py

##@ To test

lint: $(STAMPS)/venv  ## ruff (rules and format), mypy, import contract
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	.venv/bin/lint-imports --no-logo

check: $(STAMPS)/venv  ## the generated files agree with the schema, the diagrams with the sources
	$(PY) schema/generate.py --check
	$(PY) scripts/diagrams.py --check
	$(PY) scripts/screens.py --check

# Packages are unpacked on one processor while the other compiles. What installs system packages is all on one side: they
# lock each other out.
.PHONY: prepared
prepared: $(STAMPS)/demo
	@$(MAKE) --no-print-directory $(STAMPS)/venv & packages=$$!; \
	$(MAKE) --no-print-directory native cabinet $(STAMPS)/browser; compiled=$$?; \
	wait $$packages && exit $$compiled

# What computes, and the ROS nodes after it, fill the time in which the others wait. What computes leaves them the
# processor when they want it, and so does the set-up of ROS, to the end. Each goes on when another fails; all are shown
# at the end. What fails of the set-up is asked for again by the tests of ROS, and reported there. A few tests that fail
# where processors are overloaded run again when the others have ended: see tests/postponed.py.
test: export POSTPONED := build/postponed
test: prepared  ## everything; what takes long begins first
	@rm -rf $(POSTPONED)
	@( nice -n 5 $(MAKE) --no-print-directory --keep-going $(STAMPS)/ros2 $(STAMPS)/ros1 > build/test-ros-setup.log 2>&1 & \
	nice -n 5 $(MAKE) --no-print-directory --keep-going lint check test-computing > build/test-beside.log 2>&1; failed=$$?; \
	wait; $(MAKE) --no-print-directory test-ros ROS_JOBS=2 > build/test-ros.log 2>&1 || failed=1; exit $$failed ) & beside=$$!; \
	$(PY) -m pytest $(PARALLEL) $(LONGEST) $(call postpone,cabinets) -m "not computing and not alone"; failed=$$?; \
	wait $$beside || failed=1; cat build/test-ros-setup.log build/test-ros.log build/test-beside.log; exit $$failed
	@$(MAKE) --no-print-directory test-postponed
	$(PY) -m pytest $(LONGEST) -m alone $(ALONE)

.PHONY: test-postponed
test-postponed:
	@for tests in $(wildcard $(POSTPONED)/*); do echo "again, now that nothing else runs:"; cat $$tests; \
	case $$tests in */ros1-*) python=build/ros1/bin/python;; */ros2-*) python=build/ros2/bin/python;; *) python=$(PY);; esac; \
	$$python -m pytest $(LONGEST) @$$tests || exit 1; done

# Folders with tests that need no simulator; those in them that do are skipped as soon as they reach for it.
FAST := tests/values tests/wire tests/model tests/fri tests/arm tests/record tests/ros tests/schema tests/transports tests/devices \
	tests/docs tests/house tests/mutation tests/panel tests/sim tests/test_errors.py

test-fast: $(STAMPS)/venv native  ## for every save: what needs neither JVM nor MuJoCo, in about a minute
	$(PY) -m pytest -q -rfE -n $(WORKERS) -p tests.fast -m "not slow and not alone and not browser" $(FAST)

# A compiler that gets a tenth of a processor beside all others is slow, and does not hang.
test-computing: setup $(STAMPS)/browser  ## tests that mostly compute: values, protocols, kinematics, simulated steps, training, compilers, the site
	$(PY) -m pytest $(PARALLEL) --timeout 900 $(LONGEST) $(call postpone,computing) -m "computing and not alone"

# They mostly wait for arms that move, so the parts of each suite run side by side; ROS_JOBS=1 runs one after the other.
ROS_JOBS ?= 3
SIDE_BY_SIDE = @$(MAKE) --no-print-directory -j$(ROS_JOBS) $(if $(filter-out 1,$(ROS_JOBS)),--output-sync=target)

test-ros: setup $(STAMPS)/ros2 $(STAMPS)/ros1  ## both ROS nodes, parts of both side by side; ROS_JOBS=1: one after the other
	$(SIDE_BY_SIDE) ros1-shared ros2-shared ros2-own ros1-own ros2-surface ros1-surface

test-long: setup $(STAMPS)/browser  ## everything with LONG=1: soaks, long searches, all cases of conformance
	LONG=1 $(PY) -m pytest $(PARALLEL) --timeout 3600 $(LONGEST) -m "not alone"
	LONG=1 $(PY) -m pytest --timeout 3600 $(LONGEST) -m alone $(ALONE)
	scripts/setup_rviz.sh
	@LONG=1 $(MAKE) --no-print-directory test-ros
	@$(MAKE) --no-print-directory conformance
	@$(MAKE) --no-print-directory sanitized
	@$(MAKE) --no-print-directory test-pythons
	@$(MAKE) --no-print-directory mutants

mutants: $(STAMPS)/venv native  ## a hundred slips in the core, of which the fast tests have to notice ninety; SEED=2 draws others
	$(PY) -m tests.mutation --seed $(or $(SEED),1)

# What runs in the process of the tests: FRI's loop in its own process uses the usual build.
SANITIZED := tests/fri_loop/test_native.py tests/fri_loop/test_compiled.py tests/sim/test_native_tick.py \
	tests/sim/test_table.py tests/model tests/transports/test_exchange.py

sanitized: setup  ## the tests of the extension under ASan and UBSan
	$(PY) scripts/native.py --sanitize
	LD_PRELOAD="$$(cc -print-file-name=libasan.so) $$(cc -print-file-name=libubsan.so)" \
		ASAN_OPTIONS=detect_leaks=0:handle_segv=0:verify_asan_link_order=0 UBSAN_OPTIONS=print_stacktrace=1 \
		$(PY) -m pytest -q -p no:cacheprovider -p tests.sanitized $(SANITIZED)

test-pythons: cabinet  ## the package with each Python of this machine, 3.10 to 3.13, and with the oldest packages; PYTHONS="3.10 lowest" selects
	scripts/test_pythons.sh $(PYTHONS)

test-ros2: setup $(STAMPS)/ros2  ## the ROS 2 node with real rclpy, where there are wheels of it
	$(SIDE_BY_SIDE) ros2-shared ros2-own ros2-surface

test-ros1: setup $(STAMPS)/ros1  ## the ROS 1 node with a real roscore, where there are packages of it
	$(SIDE_BY_SIDE) ros1-shared ros1-own ros1-surface

# ros1 or ros2, and the part of its suite: see tests/conformance/parts.py
PARTS := ros2-shared ros2-own ros2-surface ros1-shared ros1-own ros1-surface
.PHONY: $(PARTS)
$(PARTS):
	@ros=$(firstword $(subst -, ,$@)); if [ -x build/$$ros/bin/python ]; then \
	PART=$(lastword $(subst -, ,$@)) build/$$ros/bin/python -m pytest $(LONGEST) $(call postpone,$@) tests/$$ros; \
	else echo "no ROS $${ros#ros} here: the tests of its node are skipped"; fi

conformance: setup $(STAMPS)/ros2 $(STAMPS)/ros1  ## every case of conformance against both nodes, with each kind of execution
	@for execution in servo spline fri; do for ros in ros2 ros1; do \
	if [ -x build/$$ros/bin/python ]; then echo "$$ros, $$execution:"; \
	CONFORMANCE=all EXECUTION=$$execution build/$$ros/bin/python -m pytest -q tests/$$ros/test_conformance.py || exit 1; fi; done; done

##@ To measure

bench: setup  ## figures as JSON lines; GROUP=fri or ONLY=name selects, LIST=1 lists them, STORE=1 stores the run
	@$(PY) -m bench $(if $(GROUP),--group $(GROUP)) $(if $(ONLY),--only $(ONLY)) $(if $(LIST),--list) $(if $(STORE),--store)

MINUTES ?= 3

soak: setup  ## everything at once on a virtual cabinet for MINUTES=3: what grows after the first third, what is lost; in build/soak
	$(PY) -m bench.trust --minutes $(MINUTES)

figures: $(STAMPS)/venv  ## docs/explanation/figures.md and the picture of times, from the newest stored runs
	$(PY) scripts/figures_page.py
	$(PY) scripts/times_picture.py

##@ To document and release

lock: $(STAMPS)/demo  ## versions and checksums of all packages, in scripts/lock
	$(PY) scripts/lock.py

docs: $(STAMPS)/venv  ## the site, in docs/_build/html
	.venv/bin/sphinx-build -W -q -b html docs docs/_build/html
	@$(PY) scripts/checklist_pdf.py docs/_build/html
	@echo docs/_build/html/index.html

wheel: $(STAMPS)/compiler cabinet  ## a wheel with the compiled jars, in dist/; installs only what that needs
	$(PY) -m pip wheel -q --no-deps --no-build-isolation --wheel-dir dist .

first-hour:  ## what a newcomer does, timed: clone, demo, tutorial, the wheel with each Python of this machine
	python3 scripts/first_hour.py

first-day:  ## a lab's first day from the documentation, timed: eight programs and some commands
	python3 scripts/first_day.py

clean:  ## everything that make made, but for the virtual environment
	rm -rf build dist docs/_build src/heptarm/sim/jars src/heptarm/_native*.so .pytest_cache .mypy_cache .ruff_cache .import_linter_cache

help:  ## this list
	@awk -F ':.*## ' '/^##@ / {printf "%s%s\n", (n++ ? "\n" : ""), substr($$0, 5)} /^[a-z0-9-]+:.*## / {printf "  make %-13s %s\n", $$1, $$2}' \
		$(MAKEFILE_LIST)
