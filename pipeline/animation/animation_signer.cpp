#include "pipeline/animation/animation_signer.h"

#include "core/error.h"
#include "core/store/result.h"
#include "core/usage_error.h"
#include "pipeline/animation/animation_input.h"
#include "pipeline/sealing/access_log.h"

namespace atelier {
namespace {

/// A result that a stage reads lies in its workspace's folder of the stage that made it.
std::vector<std::pair<std::string, std::string>> results_read(const StageRun& run) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const char* kind : {"person", "tracked", "bodies", "template", "registered",
                           "fitted_material", "networks", "avatar"}) {
    if (run.has_input(kind)) {
      const std::filesystem::path& result = run.input(kind);
      const std::string stage = result.parent_path().filename().string();
      all.emplace_back(stage, hex(outputs_digest(read_manifest(result, stage))));
    }
  }
  return all;
}

}  // namespace

std::optional<SignedRender> animation_signer(StageRun& run, bool by_networks) {
  const auto& options = run.options<AnimateOptions>();
  if (!options.mark) {
    return std::nullopt;
  }
  RenderStatement statement;
  statement.tool = drawing_tool();
  statement.drawn = by_networks ? kDrawnByNetworks : kDrawnPlain;
  statement.purpose = options.use.purpose;
  statement.consent = run.consent();
  statement.made_of = results_read(run);
  return signed_render(std::move(statement), options.sign, []() -> Secret {
    throw UsageError(
        "--sign names a key with a passphrase, which a stage does not ask for; name one without "
        "(atelier key --signing), or draw with 'atelier render --neural --sign'");
  });
}

void log_animation(StageRun& run, const std::optional<SignedRender>& signer) {
  const auto warn = [&](const std::exception& error) {
    run.warn(std::string("the log was not written: ") + error.what());
  };
  const std::filesystem::path workspace = run.input("person").parent_path().parent_path();
  const std::string mark =
      signer ? "mark " + mark_text(mark_of(signer->statement())) : "without a mark";
  try {
    log_access(workspace, "animate",
               "images, for " + run.options<AnimateOptions>().use.purpose + ", " + mark);
  } catch (const EnvironmentError& error) {
    warn(error);
  } catch (const DataError& error) {
    warn(error);
  }
}

}  // namespace atelier
