#include "pipeline/pattern/flatten_rules.h"

#include "pipeline/pattern/sew_check.h"

namespace atelier {
namespace {

/// Of `flatten`.
constexpr std::array<IdleRule::Value, 2> kSeamsGiven = {
    {{"seams", "auto", true}, {"find.cuts", "", true}}};
constexpr const char* kSeamsFound = "--seams auto";

constexpr std::array<IdleRule::Value, 2> kNoBody = {{{"relax.body", ""}, {}}};
constexpr const char* kHungOnBody = "--relax.body";

constexpr std::array<IdleRule::Value, 2> kNotSewn = {{{"sew_check.body", kNoSewCheck}, {}}};
constexpr const char* kSewnAnew = "--sew-check.body";

constexpr std::array<IdleRule::Value, 2> kIsotropic = {{{"layout", "isotropic"}, {}}};
constexpr const char* kOfWoven = "--layout woven";

constexpr std::array<IdleRule::Value, 2> kWoven = {{{"layout", "woven"}, {}}};
constexpr const char* kOfIsotropic = "--layout isotropic";

constexpr std::array kFlattenIdle = {
    IdleRule{"tolerance", kSeamsGiven, kSeamsFound},
    IdleRule{"find.", kSeamsGiven, kSeamsFound},
    IdleRule{"find.thread_stretch", kIsotropic, kOfWoven},
    IdleRule{"find.bias_stretch", kIsotropic, kOfWoven},
    IdleRule{"find.corners", kIsotropic, kOfWoven},
    IdleRule{"find.stretch", kWoven, kOfIsotropic},
    IdleRule{"relax.fabric", kNoBody, kHungOnBody},
    IdleRule{"relax.registered", kNoBody, kHungOnBody},
    IdleRule{"relax.gap", kNoBody, kHungOnBody},
    IdleRule{"relax.substeps", kNoBody, kHungOnBody},
    IdleRule{"relax.relaxing.", kNoBody, kHungOnBody},
    IdleRule{"sew_check.fabric", kNotSewn, kSewnAnew},
    IdleRule{"sew_check.edge_length", kNotSewn, kSewnAnew},
    IdleRule{"sew_check.seconds", kNotSewn, kSewnAnew},
};

}  // namespace

const OptionRules& flatten_rules() {
  static constexpr OptionRules rules{.idle = kFlattenIdle};
  return rules;
}

}  // namespace atelier
