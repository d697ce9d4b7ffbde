#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)

#include "apps/truth_subject.h"

namespace atelier {

TruthSubject truth_subject(const std::filesystem::path& capture) {
  TruthSubject result;
  const auto truth = std::make_shared<const CaptureTruth>(read_capture_truth(capture));
  result.truth = truth;
  const auto add = [&](const std::string& name, const Mesh& mesh) {
    result.subject.names.push_back(name);
    result.subject.faces.push_back(mesh.faces);
    result.templates.push_back(mesh);
  };
  add("body", truth->body);
  for (std::size_t i = 0; i < truth->layers.size(); ++i) {
    add(truth->layer_names[i], truth->layers[i]);
  }
  result.first_garment = result.templates.size();
  for (const TruthGarment& garment : truth->garments) {
    add(garment.garment.name, garment.garment.mesh);
  }
  result.subject.load = [truth, capture](int frame_id) {
    const TruthFrame frame = read_truth_frame(capture, *truth, frame_id);
    std::vector<Points> surfaces = {frame.body};
    surfaces.insert(surfaces.end(), frame.layers.begin(), frame.layers.end());
    surfaces.resize(1 + truth->layers.size());
    surfaces.insert(surfaces.end(), frame.garments.begin(), frame.garments.end());
    surfaces.resize(1 + truth->layers.size() + truth->garments.size());
    return surfaces;
  };
  return result;
}

}  // namespace atelier

#endif
