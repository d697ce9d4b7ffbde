#include "simulation/cloth/cloth_state.h"

namespace atelier {

ClothState rest_state(const Cloth& cloth) {
  return {cloth.rest_positions, Points::Zero(cloth.rest_positions.rows(), 3), 0};
}

}  // namespace atelier
