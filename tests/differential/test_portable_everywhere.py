"""Portable arithmetic: the same bits from Python, gcc, clang and a Cortex-M4F, in both types."""

from __future__ import annotations

import importlib.util
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real

if TYPE_CHECKING:
    from types import ModuleType

    from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
COUNT = 4_000
STEP, COMPILED, RESET = 0, 1, 2
STRICT = [
    "-std=c99",
    *("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow"),
    "-Werror",
]
M4F = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
HOSTS = {
    "gcc at O0": ["gcc", "-O0"],
    "gcc at O2": ["gcc", "-O2"],
    "gcc for this machine": ["gcc", "-O2", "-march=native"],
    "clang": ["clang", "-O2"],
}
# Reads records (what, instance, t, y_d, x...) of doubles and writes (u, status) for each.
DRIVER = """
#include <stdio.h>
#include <string.h>
#include "NAME.h"
int main(void)
{
    static NAME_state states[2];
    static double in[256][4 + NAME_ORDER], out[256][2];
    FILE *from = fopen("in.bin", "rb"), *to = fopen("out.bin", "wb");
    size_t count, j;
    int i;
    memset(states, 0, sizeof states);
    while ((count = fread(in, sizeof in[0], 256, from)) > 0) {
        for (j = 0; j < count; ++j) {
            const double *r = in[j];
            NAME_state *s = &states[(int)r[1]];
            NAME_real x[NAME_ORDER], u = 0;
            for (i = 0; i < NAME_ORDER; ++i) x[i] = (NAME_real)r[4 + i];
            out[j][1] = 0.0;
            if (r[0] >= 2.0) NAME_reset(s);
            else out[j][1] = NAME_step(s, (NAME_real)r[2], x, YD, &u);
            out[j][0] = u;
        }
        fwrite(out, sizeof out[0], count, to);
    }
    fclose(to);
    return 0;
}
"""
OWN = "r[0] == 1.0 ? NAME_reference(s->started ? (NAME_real)r[2] - s->t_0 : 0) : (NAME_real)r[3]"
LINKER = """
MEMORY { FLASH (rx) : ORIGIN = 0, LENGTH = 4M  RAM (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
ENTRY(Reset_Handler)
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) KEEP(*(.init)) KEEP(*(.fini)) } > FLASH
  .ARM.exidx : { __exidx_start = .; *(.ARM.exidx*) __exidx_end = .; } > FLASH
  .init_array : { __preinit_array_start = .; __preinit_array_end = .;
    __init_array_start = .; KEEP(*(.init_array*)) __init_array_end = .;
    __fini_array_start = .; __fini_array_end = .; } > FLASH
  .data : { *(.data*) } > RAM
  .bss : { __bss_start__ = .; *(.bss*) *(COMMON) __bss_end__ = .; } > RAM
  end = .; __end__ = .;
  __StackTop = ORIGIN(RAM) + LENGTH(RAM);
}
"""
STARTUP = """
extern void _start(void);
extern unsigned __StackTop;
void Reset_Handler(void);
__attribute__((section(".vectors"), used)) void *const vectors[] = {&__StackTop, Reset_Handler};
void Reset_Handler(void)
{
    *(volatile unsigned *)0xE000ED88u |= 0xF00000u;
    __asm volatile("dsb\\nisb");
    _start();
    for (;;) {}
}
"""


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


beside = load(Path(__file__).with_name("test_c_equals_python.py"), "samples_of_c_equals_python")
DESIGNS = {name: beside.handmade.DESIGNS[name] for name in ("everyday", "run_time")}


def run(folder: Path, *command: str) -> None:
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, (command, done.stderr[-2000:])


class Written:
    """One generated controller, its samples, and Python's answers."""

    def __init__(self, folder: Path, design: str, real: Real, count: int = COUNT) -> None:
        arithmetic = Arithmetic(real=real, mathematics=Mathematics.PORTABLE)
        self.folder = folder
        self.name = beside.write(replace(DESIGNS[design](), arithmetic=arithmetic), folder)
        self.module = load(folder / "controller.py", f"controller_{design}_{real}")
        compiled = "_reference(" in (folder / f"c/include/{self.name}.h").read_text()
        self.records = beside.samples(self.module, count, compiled=compiled, seed=7)
        # Within what the clock of binary32 tells.
        self.records[:, 2] *= 0.02
        self.records[self.records[:, 0] > RESET, 0] = RESET
        (folder / "in.bin").write_bytes(self.records.tobytes())
        text = DRIVER.replace("YD", OWN if compiled else "(NAME_real)r[3]")
        (folder / "driver.c").write_text(text.replace("NAME", self.name))
        self.expected = beside.Pair.python(self, self.records)

    def compile(self, compiler: list[str], target: str) -> None:
        include = ["-Ic/include", "-ffp-contract=off"]
        own = [*compiler, *STRICT, *include, "-c", f"c/src/{self.name}.c", "-o", "own.o"]
        run(self.folder, *own)
        run(self.folder, *compiler, "-std=c99", *include, "-c", "driver.c", "-o", "driver.o")
        if target == "host":
            run(self.folder, compiler[0], "driver.o", "own.o", "-o", "driver", "-lm")

    def answers(self) -> NDArray[np.float64]:
        return np.frombuffer((self.folder / "out.bin").read_bytes()).reshape(-1, 2)

    def agree(self) -> None:
        found = self.answers()
        apart = (found.view(np.int64) != self.expected.view(np.int64)).any(axis=1)
        first = np.flatnonzero(apart)[:1]
        assert len(found) == len(self.records)
        assert not apart.any(), (int(apart.sum()), self.records[first], found[first])
        steps = self.records[:, 0] < RESET
        inside = self.expected[steps, 1] <= 1
        assert inside.mean() > 0.6
        assert len(np.unique(self.expected[steps, 0][inside])) > 0.2 * steps.sum()


@pytest.mark.parametrize("real", list(Real))
@pytest.mark.parametrize("design", sorted(DESIGNS))
def test_python_and_every_compiler_give_the_same_bits(
    design: str, real: Real, tmp_path: Path
) -> None:
    written = Written(tmp_path, design, real)
    for compiler in HOSTS.values():
        written.compile(compiler, "host")
        run(tmp_path, "./driver")
        written.agree()


@pytest.mark.parametrize("real", list(Real))
def test_a_cortex_m4f_gives_the_same_bits(real: Real, tmp_path: Path) -> None:
    written = Written(tmp_path, "everyday", real)
    written.compile(["arm-none-eabi-gcc", "-O2", *M4F], "target")
    (tmp_path / "startup.c").write_text(STARTUP)
    (tmp_path / "target.ld").write_text(LINKER)
    link = ["-T", "target.ld", "--specs=rdimon.specs", "-Wl,--gc-sections"]
    sources = ["startup.c", "driver.o", "own.o"]
    run(tmp_path, "arm-none-eabi-gcc", "-O2", *M4F, *sources, *link, "-o", "target.elf")
    machine = ["qemu-system-arm", "-M", "mps2-an386", "-nographic", "-monitor", "none"]
    run(
        tmp_path,
        *machine,
        "-semihosting-config",
        "enable=on,target=native",
        "-kernel",
        "target.elf",
    )
    written.agree()


def test_a_float_controller_has_no_operation_in_double(tmp_path: Path) -> None:
    for mathematics in Mathematics:
        arithmetic = Arithmetic(real=Real.FLOAT, mathematics=mathematics)
        name = beside.write(replace(DESIGNS["everyday"](), arithmetic=arithmetic), tmp_path)
        command = ["arm-none-eabi-gcc", "-O2", *M4F, *STRICT, "-Ic/include", "-ffp-contract=off"]
        run(tmp_path, *command, "-c", f"c/src/{name}.c", "-o", "own.o")
        done = subprocess.run(
            ["arm-none-eabi-nm", "-u", "own.o"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
        wanted = set(done.stdout.replace("U ", "").split())
        assert wanted == ({"tanhf", "cosf", "sinf"} if mathematics is Mathematics.LIBM else set())


def test_the_samples_notice_one_bit_of_a_portable_function(tmp_path: Path) -> None:
    written = Written(tmp_path, "everyday", Real.DOUBLE)
    path = tmp_path / f"c/src/{written.name}.c"
    text = path.read_text()
    assert text.count("4729725.0") == 1
    path.write_text(text.replace("4729725.0", "4729725.0000000009"))
    written.compile(HOSTS["gcc at O2"], "host")
    run(tmp_path, "./driver")
    with pytest.raises(AssertionError):
        written.agree()
