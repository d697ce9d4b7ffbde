#include <exception>
#include <regex>
#include <string>

#include "core/error.h"
#include "core/not_converged.h"
#include "core/store/digest_meter.h"
#include "core/unknown_value.h"
#include "core/usage_error.h"
#include "python/bindings.h"

namespace atelier::python {
namespace {

namespace py = pybind11;

/// Raises a class of atelier/errors.py with its fields.
template <class... Fields>
void raise(const char* name, const Fields&... fields) {
  const py::object type = py::module_::import("atelier.errors").attr(name);
  const py::object error = type(fields...);
  PyErr_SetObject(type.ptr(), error.ptr());
}

/// Of "file.cpp:12: what is wrong (condition)" what is wrong: the rest is for who reads the source.
std::string without_place(const std::string& text) {
  static const std::regex kPlaced(R"(\w+\.\w+:\d+: (.*?) \(.*\))");
  std::smatch parts;
  return std::regex_match(text, parts, kPlaced) ? parts[1].str() : text;
}

void translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const UnknownValue& error) {
    raise("UnknownValue", error.file, error.where, error.found, error.expected, error.option,
          error.value);
  } catch (const DataError& error) {
    raise("DataError", error.file, error.where, error.found, error.expected);
  } catch (const EnvironmentError& error) {
    raise("EnvironmentError", error.place, error.reason);
  } catch (const UsageError& error) {
    raise("UsageError", error.what());
  } catch (const NotConverged& error) {
    raise("NotConverged", error.what());
  } catch (const LogicError& error) {
    raise("LogicError", without_place(error.what()));
  } catch (const StopRequested&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  }
}

}  // namespace

void bind_errors() {
  py::register_exception_translator(&translate);
}

}  // namespace atelier::python
