# Thin: installs missing Debian packages (tools/packages.txt), then calls Meson.
BUILD = build
MESON_FLAGS =

.NOTPARALLEL: # with -j too packages come before what needs them; ninja uses all cores by itself

all: packages-build $(BUILD)/build.ninja
	ninja -C $(BUILD)

$(BUILD)/build.ninja:
	meson setup $(BUILD) $(MESON_FLAGS)

packages-%:
	@tools/packages.sh $(subst -, ,$*)

npm-packages:
	@tools/npm.sh

test: packages-build-run-test $(BUILD)/build.ninja | npm-packages
	ninja -C $(BUILD)
	meson test -C $(BUILD) --no-rebuild --print-errorlogs

# The same tests with the address and undefined-behaviour sanitizers, without the long ones.
test-sanitizers: packages-build-run-test build-asan/build.ninja
	ninja -C build-asan
	UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 \
	    meson test -C build-asan --no-rebuild --print-errorlogs --no-suite slow --timeout-multiplier 5

build-asan/build.ninja:
	meson setup build-asan -Db_sanitize=address,undefined --buildtype debugoptimized -Db_lundef=false $(MESON_FLAGS)

# What threads do together, with the thread sanitizer: a tiny capture trained and rendered, and whatever else is shared.
THREADED = base knn initialise initialise_run poses_parts render 'settings in all combinations'
test-threads: packages-build-run-test build-tsan/build.ninja
	setarch -R true 2>/dev/null && fixed="setarch -R"; \
	TSAN_OPTIONS="suppressions=$(CURDIR)/tests/tsan.txt history_size=4" $$fixed \
	    meson test -C build-tsan --print-errorlogs --timeout-multiplier 5 $(THREADED)

build-tsan/build.ninja: # no -Werror: gcc's warnings about instrumented code are often wrong
	meson setup build-tsan -Db_sanitize=thread --buildtype debugoptimized -Db_lundef=false

# The same sources through clang.
test-clang: packages-build-run-test build-clang/build.ninja
	ninja -C build-clang
	meson test -C build-clang --no-rebuild --print-errorlogs --no-suite slow

build-clang/build.ninja:
	CC=clang meson setup build-clang $(MESON_FLAGS)

# Which lines of src/ the tests reach, per folder; tools/coverage.py build-coverage --missing names the others.
coverage: packages-build-run-test build-coverage/build.ninja
	ninja -C build-coverage
	find build-coverage -name '*.gcda' -delete
	-meson test -C build-coverage --no-rebuild --print-errorlogs # `faults` fails: gcov itself needs memory at the end
	tools/coverage.py build-coverage

build-coverage/build.ninja:
	meson setup build-coverage -Db_coverage=true --buildtype debugoptimized $(MESON_FLAGS)

# Coverage-guided fuzzing of every reader; see tests/fuzz/README.md.
FUZZ_SECONDS = 600
fuzz: packages-build-run-test build-fuzz/build.ninja
	ninja -C build-fuzz tests/fuzz/fuzz
	tests/fuzz/run.sh build-fuzz/tests/fuzz/fuzz $(FUZZ_SECONDS) $(KINDS)

build-fuzz/build.ninja:
	CC=clang meson setup build-fuzz -Dfuzzer=true -Db_sanitize=address,undefined --buildtype debugoptimized \
	    -Db_lundef=false $(MESON_FLAGS)

demo: packages-build-run all
	tools/demo.sh $(BUILD)/flashsplat

bench: all
	$(BUILD)/flashsplat bench

# Separation quality on every scene, made ones included; e.g. QUALITY="--variants full,linear --only poster".
quality: packages-build-run-test all
	/usr/bin/python3 bench/quality.py --flashsplat $(BUILD)/flashsplat $(QUALITY)

# Methods over scenes, one report with pictures; e.g. COMPARE="--only poster --methods full,paper".
compare: packages-build-run-test all
	/usr/bin/python3 bench/compare.py --flashsplat $(BUILD)/flashsplat $(COMPARE)

install: all
	meson install -C $(BUILD) --no-rebuild

clean:
	rm -rf build build-asan build-clang build-coverage build-fuzz build-tsan demo

.PHONY: all npm-packages test test-sanitizers test-threads test-clang coverage fuzz demo bench quality compare install clean
