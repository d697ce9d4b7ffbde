#pragma once

#include <string>

#include "capture/frame_reader.h"
#include "capture/validate.h"

namespace atelier {

/// The findings of validate as one HTML page that needs no other file, runs no script and loads
/// nothing: the verdict and the settings that would put the capture right, findings, where cameras
/// stand, errors of cameras, joints and frames, and contact sheets of up to three frames with what
/// was detected and what was made of it. Every text that came from a file is escaped.
/// @param name  of the capture, for the title
std::string validate_page(FrameReader& reader, const Validation& validation,
                          const std::string& name);

}  // namespace atelier
