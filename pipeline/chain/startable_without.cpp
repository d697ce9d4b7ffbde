#include "pipeline/chain/startable_without.h"

#include <algorithm>

#include "core/error.h"
#include "core/store/result.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/stages/stages.h"

namespace atelier {

void require_startable_without(const Stage& stage, const StageRequest& request,
                               std::span<const std::string> aside) {
  const DatasetOptions options = capture_options(request.options.table);
  open_dataset(request.input, options);
  for (const std::string_view kind : stage.inputs) {
    const Stage* maker = kind.empty() ? nullptr : stage_that_makes(all_stages(), kind);
    if (maker == nullptr) {
      continue;
    }
    const std::filesystem::path folder = request.workspace / maker->name;
    if (std::find(aside.begin(), aside.end(), maker->name) != aside.end() ||
        !current_name(folder)) {
      throw DataError(folder.string(), "",
                      "no result of this capture, which " + std::string(stage.name) + " reads",
                      "a sound result; 'atelier run " + request.input.string() + " " +
                          request.workspace.string() + " --replace --to " +
                          std::string(maker->name) +
                          "' sets the other capture's aside and makes "
                          "it");
    }
  }
  require_startable(stage, request);
}

}  // namespace atelier
