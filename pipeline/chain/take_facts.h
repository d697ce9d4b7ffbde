#pragma once

#include <string>

#include "capture/layouts/capture_facts.h"

namespace atelier {

/// A take that is not there yet, of a text such as "200x10000x4": cameras, frames, megapixels of an
/// image. Of its frames a tenth are minimally clothed (our choice). Throws UsageError.
CaptureFacts facts_of_take(const std::string& text);

}  // namespace atelier
