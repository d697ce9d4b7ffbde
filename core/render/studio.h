#pragma once

#include <functional>
#include <vector>

#include "core/options.h"
#include "core/render/framing.h"
#include "core/render/render.h"
#include "core/render/scene.h"

namespace atelier {

/// The light of every image of the program: a large soft key from the upper left of the front, a
/// weak rim from behind, a grey sky as fill, seamless paper under and behind the subject. Lights
/// stand in proportion to the meshes' size and to where the viewer is (`azimuth` of View, radians),
/// so that every side of a subject is lit alike; the ground lies under the lowest point. A scene
/// without meshes is the empty studio. Throws DataError for meshes without a face, or all of them
/// within 10 micrometres.
Scene studio_scene(std::vector<RenderMesh> meshes, double azimuth = 0);

struct PictureOptions {
  int width = 600;   ///< pixels, [1, 16384]
  int height = 800;  ///< pixels, [1, 16384]
  int samples = 8;   ///< per pixel; 4 for previews, 32 for print
  FramingOptions framing;
};

OptionTable describe(PictureOptions& options);

/// A mesh in the studio, tone mapped: linear RGB in [0,1], ready for srgb_from_linear. Without a
/// `look`, a soft grey clay whose inner sides are warm, times the mesh's own colours.
Image picture_of(const Mesh& mesh, const View& view = kThreeQuarter,
                 const PictureOptions& options = {});

/// Several meshes with their looks.
Image picture_of(const std::vector<RenderMesh>& meshes, const View& view = kThreeQuarter,
                 const PictureOptions& options = {});

/// `count` images all the way round at one distance: the subject turns, the light does not. Asked
/// before each, `stop` ends it with those that there are.
std::vector<Image> turntable_of(const std::vector<RenderMesh>& meshes, int count,
                                const View& start = kFront, const PictureOptions& options = {},
                                const std::function<bool()>& stop = {});

/// The clay that picture_of gives a mesh without a look.
Look clay_look();

}  // namespace atelier
