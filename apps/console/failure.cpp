#include "apps/console/failure.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

#include "apps/console/device_advice.h"
#include "apps/console/option_flags.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/not_converged.h"
#include "core/store/consent_refused.h"
#include "core/system_reason.h"
#include "core/unknown_value.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

/// The advice in a reason stands behind its first semicolon.
Failure environment_failure(const std::string& place, const std::string& reason) {
  const std::size_t end = std::min(reason.find("; "), reason.size());
  return {place + ": " + reason,
          kExitEnvironment,
          place,
          "",
          reason.substr(0, end),
          end < reason.size() ? reason.substr(end + 2) : ""};
}

/// A value that asks for what is not there, with the flag as it was typed.
Failure unknown_value(const UnknownValue& unknown) {
  const std::string flag = flag_of_value(unknown.option, unknown.value);
  const std::string text =
      (flag.empty() ? unknown.option : flag) + " cannot be " + unknown.found +
      (unknown.file.empty() ? ": it takes " : ": of " + unknown.file + " it takes ") +
      unknown.expected;
  return {text, kExitUsage, "", "", text, ""};
}

Failure failure_as_it_is(const std::exception& error) {
  if (const auto* unknown = dynamic_cast<const UnknownValue*>(&error)) {
    return unknown_value(*unknown);
  }
  if (const auto* data = dynamic_cast<const DataError*>(&error)) {
    return {error.what(), kExitBadData, data->file, data->where, data->found, data->expected};
  }
  if (dynamic_cast<const UsageError*>(&error) != nullptr) {
    const std::string text = with_typed_flags(error.what());
    return {text, kExitUsage, "", "", text, ""};
  }
  if (dynamic_cast<const ConsentRefused*>(&error) != nullptr) {
    return {error.what(), kExitCheckFailed, "", "", error.what(), ""};
  }
  if (dynamic_cast<const NotConverged*>(&error) != nullptr) {
    return {error.what(), kExitNotConverged, "", "", error.what(), ""};
  }
  if (const auto* environment = dynamic_cast<const EnvironmentError*>(&error)) {
    return environment_failure(environment->place, with_device_advice(*environment));
  }
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    const int reason = file->code().value();
    return environment_failure(denied_place(file->path1(), reason).string(), system_reason(reason));
  }
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system != nullptr && (system->code().category() == std::generic_category() ||
                            system->code().category() == std::system_category())) {
    return environment_failure("the system", system_reason(system->code().value()));
  }
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    return environment_failure("memory", "there is not enough; use fewer --jobs or smaller data");
  }
  return {std::string(error.what()) + "; this is a defect of the program",
          kExitBug,
          "",
          "",
          error.what(),
          "not a defect of the program"};
}

/// A place, and by which name errors call it.
std::pair<std::string, std::string> called;

}  // namespace

void call_place(const std::string& place, const std::string& name) {
  called = {place, name};
}

std::string as_called(std::string text) {
  const auto& [place, name] = called;
  std::size_t at = place.empty() ? std::string::npos : text.find(place);
  for (; at != std::string::npos; at = text.find(place, at + name.size())) {
    text.replace(at, place.size(), name);
  }
  return text;
}

Failure failure_of(const std::exception& error) {
  Failure failure = failure_as_it_is(error);
  for (std::string* text :
       {&failure.text, &failure.file, &failure.where, &failure.found, &failure.expected}) {
    *text = as_called(std::move(*text));
  }
  return failure;
}

}  // namespace atelier
