#include "apps/console/stand_alone.h"

namespace atelier {

const StandAlone* stand_alone(std::string_view stage) {
  for (const StandAlone& one : all_stand_alone()) {
    if (one.stage == stage) {
      return &one;
    }
  }
  return nullptr;
}

}  // namespace atelier
