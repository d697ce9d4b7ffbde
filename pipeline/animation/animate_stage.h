#pragma once

#include <array>

#include "core/store/stage.h"
#include "pipeline/animation/animation_input.h"

namespace atelier {

inline constexpr std::array kAnimateMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"garments", ""},
    StageMetric{"vertices", "of cloth"},
    StageMetric{"strain_p99", "of rest length"},
    StageMetric{"penetration_depth", "m"},
    StageMetric{"penetration_rate", "of the vertices"},
    StageMetric{"self_intersections", "in a frame"},
    StageMetric{"registered_distance", "m"},
    StageMetric{"held_distance", "m"},
    StageMetric{"seen_inverted", "faces in a frame"},
    StageMetric{"seen_stretch", "of an edge"},
    StageMetric{"drawn_low", "of the mean texture"},
    StageMetric{"drawn_high", "of the mean texture"},
    StageMetric{"seconds_a_frame", "s"},
    StageMetric{"picture_seconds", "s"},
};

/// Person, motion, garments and material -> frames/ (the cloth's state in every frame, schema
/// "atelier.animated_frame", from which a run that was ended goes on with the same bits), body/ and
/// garments/<name>/ (core/sequence_archive.h), body.npz and motion.npz (who moves, and how),
/// figures.json, with an avatar seen/ (the body as it is seen), and pictures/, animation.mp4 and
/// strip.png, which are marked and signed as statement.json says.
void run_animate(StageRun& run);

}  // namespace atelier
