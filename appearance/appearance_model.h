#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "appearance/appearance_colors.h"
#include "appearance/appearance_data.h"
#include "core/options.h"
#include "core/tensor.h"

namespace atelier {

/// The text `schema` of a network's file.
inline constexpr const char* kModelSchema = "atelier.appearance";

/// How a garment's network is built. Texture = (mean + view-independent + view-dependent) x shadow,
/// times the gain of the camera, in linear light (Xiang et al., "Dressing Avatars", 2022).
///
/// Both texture branches are one UNet: a 3x3 convolution, then per level a 4x4 convolution of
/// stride 2 down to 8x8 texels, the same transposed up with what was there on the way down added,
/// and a 3x3 convolution of the first level's features and the inputs. Widths double from level to
/// level up to 8 x `channels`. Convolutions are weight-normalised (Salimans and Kingma 2016),
/// followed by LeakyReLU of slope 0.2. The view-independent branch takes the normal in the world,
/// where lights stand still, and the light transfer (appearance/occlusion.h), which says from where
/// light reaches the cloth; the view-dependent one the view's direction in the tangent frame and
/// the first's features. The shadow network, three 3x3 convolutions at a quarter of the resolution,
/// takes the transfer minus its mean and ends in a sigmoid. Normal and transfer are those of the
/// side that the camera is on: the inside of a skirt is lit otherwise than its outside, by other
/// light.
///
/// Chosen here, where the published text is silent: depth and widths, added instead of concatenated
/// skip connections (half the arithmetic), a first output of 0 (the start is the static texture),
/// branches that give their parts in units of the mean texture (a print is shaded by one number
/// where it would take another one for each of its colours), transfer as an input of the first
/// branch (it tells inside from outside of folds), branches coarser than the texture (at the
/// print's own scale they would learn each image's misalignment by heart).
struct NetworkOptions {
  int resolution = 256;          ///< texels a side, a power of 2 from 16 to 2048
  int channels = 8;              ///< width of the first level, 1..128
  bool view_independent = true;  ///< false and no view_dependent: a mean texture alone
  bool view_dependent = true;
  bool shadow = true;
  int shading = 2;  ///< texels of the texture along one of the branches', 1..16, a power of 2:
                    ///< folds are larger than prints, which are the mean texture's
  int transfer_degree = 1;  ///< of the light transfer's harmonics that it is given, 0..2; 0: the
                            ///< ambient visibility alone, which does not know where the lamps are
  bool pixel_bias = false;  ///< a bias for each texel instead of each channel (Lombardi et al.
                            ///< 2018): more detail, less generalisation
  int pose_parts = 0;       ///< of a body, J of BodyParts, to kMaxPoseParts; 0: no code of its pose
  int latent = 0;           ///< numbers of the latent code, to kMaxLatent; 0: none
  bool geometry = false;    ///< whether pose and latent code also move the surface
};
inline constexpr int kMaxPoseParts = 1000;
inline constexpr int kMaxLatent = 4096;

/// What a network that has a code is conditioned on (Bagautdinov et al., "Driving-signal aware
/// full-body avatars", 2021): the turn of each of a body's parts, spread over the atlas by masks of
/// where it is felt, and a latent code of whatever else differs between frames. An encoder makes
/// the latent code of a training frame from its surface's offsets and its residual texture, as a
/// normal distribution that training keeps near the standard one (Kingma and Welling 2014); drawn
/// is with a latent code of zeros. Both become features of code_resolution_of texels a side: a part
/// of the texture in units of the mean texture, as the branches give theirs, an input of the first
/// branch, and of a second decoder that gives offsets of the surface.
inline bool has_code(const NetworkOptions& options) {
  return options.pose_parts > 0 || options.latent > 0;
}

/// Texels a side of the code's features, and of the offsets that they give.
int code_resolution_of(const NetworkOptions& options);
int offset_resolution_of(const NetworkOptions& options);

/// Channels that the encoder of the latent code sees: the offset, its support, the residual
/// texture, and where there is one.
inline constexpr int kEncodedChannels = 8;

/// Texels a side where the encoder ends and the latent code's decoder begins.
inline constexpr int kLatentSide = 4;
/// How often the encoder halves code_resolution_of until then.
int code_levels_of(const NetworkOptions& options);

OptionTable describe(NetworkOptions& options);

/// Texels a side of the shadow: a quarter, at least 8.
int shadow_resolution_of(int resolution);
/// Texels a side of what the branches see and give, at least 16.
int branch_resolution_of(const NetworkOptions& options);

/// How often a branch's UNet halves that, down to 8 texels a side.
int branch_levels_of(const NetworkOptions& options);

/// A parameter's name and shape.
struct ParameterShape {
  std::string name;
  std::vector<std::int64_t> shape;
};

/// Everything that is learnt, in the order of the names: "dependent.down0.g", ..., "gain.log"
/// [C,3], "texture.mean" [3,R,R]. Convolutions have a direction `v`, a length `g` and a bias `b`.
std::vector<ParameterShape> network_parameters(const NetworkOptions& options, int cameras);

/// Light transfer of one side.
using MeanTransfer = Eigen::Matrix<float, Eigen::Dynamic, kTransferTerms, Eigen::RowMajor>;

/// A network with all that it takes to draw a garment: plain data, as the file holds it.
struct AppearanceModel {
  std::string name;  ///< of the garment
  NetworkOptions options;
  Triangles faces;  ///< as AppearanceData
  Points2 uvs;
  Triangles uv_faces;
  std::vector<std::string> camera_ids;        ///< that it was trained with
  std::map<std::string, Tensor> parameters;   ///< float32, network_parameters
  Image static_texture;                       ///< [R,R,3] the best texture that does not change
  std::vector<float> static_gain;             ///< [3C] with its gains
  MeanTransfer mean_transfer;                 ///< [V,9] of the outside, over the training frames
  std::optional<OcclusionOptions> occlusion;  ///< with which light transfer was measured, as it is
                                              ///< to be again; nothing: of an older program
  std::optional<BodyParts> parts;             ///< if pose_parts: of the body
  std::optional<DrawnRange> drawn;            ///< of what it learnt from, where that was measured
};

/// The model before training: parameters random by `seed` (He et al. 2015), the mean texture the
/// static one (of that smoothness), gains with it. Throws DataError for data without views or
/// frames.
AppearanceModel initial_model(const AppearanceData& data, const NetworkOptions& options,
                              std::uint64_t seed, double smoothness = 0);

/// As named tensors with texts (schema "atelier.appearance", its version and the architecture),
/// what safetensors files hold, and back. Reading throws DataError for another schema or version,
/// tensors that are missing, too many, of another shape or type, numbers that are not finite,
/// texture coordinates outside of [0,1], cameras without a name of their own, and contents that are
/// not those of their digest (content_digest.h).
std::map<std::string, Tensor> tensors_of(const AppearanceModel& model);
std::map<std::string, std::string> texts_of(const AppearanceModel& model);
AppearanceModel appearance_model_of(const std::map<std::string, Tensor>& tensors,
                                    const std::map<std::string, std::string>& texts,
                                    const std::string& file = "");

/// Throws DataError unless the model is of this architecture; says in what they differ.
void require_architecture(const AppearanceModel& model, const NetworkOptions& options,
                          const std::string& file = "");

}  // namespace atelier
