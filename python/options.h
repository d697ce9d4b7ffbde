#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "core/options.h"

// Structs of options are dataclasses in Python, made from what `describe()` says of them
// (atelier/options.py). A function that takes one accepts it, a dict with the same names, or None
// for the defaults.

namespace atelier::python {

/// Sets the fields of a table from a dataclass of options, a dict (nested, or with dots in the
/// names) or None. Throws UsageError with a line for each value that was refused.
void set_options(OptionTable table, pybind11::handle given);

/// Values of a table as a dict of dicts.
pybind11::dict options_dict(const OptionTable& table);

/// An instance of the dataclass of that name with the values of a table.
pybind11::object options_object(const std::string& name, const OptionTable& table);

/// Makes atelier.<name> a dataclass with the fields of this set.
void add_options_class(const std::string& name, OptionSet (*defaults)());

}  // namespace atelier::python

/// The caster of a struct of options, outside of any namespace: ATELIER_OPTIONS(ClothOptions);
#define ATELIER_OPTIONS(Type)                                                           \
  namespace pybind11::detail {                                                          \
  template <>                                                                           \
  struct type_caster<atelier::Type> {                                                   \
    PYBIND11_TYPE_CASTER(atelier::Type, const_name(#Type));                             \
    bool load(handle given, bool /*convert*/) {                                         \
      if (!given.is_none()) { /* a table costs microseconds */                          \
        atelier::python::set_options(describe(value), given);                           \
      }                                                                                 \
      return true;                                                                      \
    }                                                                                   \
    static handle cast(atelier::Type options, return_value_policy /*policy*/, handle) { \
      return atelier::python::options_object(#Type, describe(options)).release();       \
    }                                                                                   \
  };                                                                                    \
  }                                                                                     \
  static_assert(true)

/// Makes the dataclass; in the function that binds the domain.
#define ATELIER_OPTIONS_CLASS(Type) \
  ::atelier::python::add_options_class(#Type, &::atelier::option_set<::atelier::Type>)
