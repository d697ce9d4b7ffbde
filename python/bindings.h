#pragma once

#include <pybind11/pybind11.h>

// The module atelier._atelier, a file for each domain. Classes are declared before the functions
// that name them, so that the signatures in docstrings, from which the stubs are made, are
// Python's.

namespace atelier::python {

void bind_errors();
void bind_options(pybind11::module_& module);
void bind_core(pybind11::module_& module);
void bind_files(pybind11::module_& module);
void bind_body(pybind11::module_& module);
void bind_capture(pybind11::module_& module);
void bind_pattern(pybind11::module_& module);
void bind_cloth(pybind11::module_& module);
void bind_render(pybind11::module_& module);
void bind_workspace(pybind11::module_& module);
void bind_bench(pybind11::module_& module);

}  // namespace atelier::python
