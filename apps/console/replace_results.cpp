#include "apps/console/replace_results.h"

#include <algorithm>
#include <iostream>
#include <optional>

#include "apps/console/interrupt.h"
#include "core/printable.h"
#include "core/store/digest_meter.h"
#include "core/usage_error.h"
#include "pipeline/stages/other_capture.h"

namespace atelier {
namespace {

std::optional<OtherCapture> look_for_other(const ReplaceRequest& request) {
  try {
    return other_capture(request.workspace, request.capture, request.events);
  } catch (const StopRequested&) {
    end_by_signal();
  }
}

}  // namespace

bool reads_capture(const Stage& stage) {
  return std::find(stage.inputs.begin(), stage.inputs.end(), "capture") != stage.inputs.end();
}

std::vector<std::string> replace_results(
    const ReplaceRequest& request,
    const std::function<void(const std::vector<std::string>& aside)>& ready) {
  const std::optional<OtherCapture> other = look_for_other(request);
  if (!other) {
    return {};
  }
  std::string stages;
  for (const std::string& stage : other->stages) {
    stages += (stages.empty() ? "" : ", ") + stage;
  }
  if (!request.replace) {
    throw UsageError("WORKSPACE cannot be '" + request.workspace.string() +
                     "': it holds results of another capture, " + other->path + " (" + stages +
                     "): " + other->difference +
                     "; name another folder, or give --replace, which sets them aside");
  }
  ready(other->stages);
  if (!request.dry_run) {
    set_aside(request.workspace, other->stages);
  }
  if (!request.quiet) {
    std::cout << request.command << ": results of " << printable(other->path)
              << (request.dry_run ? " would be" : " are") << " set aside: " << stages << std::endl;
  }
  return other->stages;
}

}  // namespace atelier
