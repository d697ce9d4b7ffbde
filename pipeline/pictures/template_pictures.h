#pragma once

#include <vector>

#include "core/image.h"
#include "registration/template/garment_template.h"

namespace atelier {

/// Every template on the body of its frame from its front, its left and behind, its triangles
/// drawn, what hangs free darker, each opening in a colour of its own; and its charts. Linear RGB.
Image template_picture(const std::vector<GarmentTemplate>& made, const ClothedFrames& frames);

}  // namespace atelier
