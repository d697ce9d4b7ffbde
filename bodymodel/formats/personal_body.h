#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/io/npz.h"
#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// One person's body: what the stage `personalize` makes and `track` and `body` read. The model's
/// neutral shape is the person: bone lengths and the displaced surface are in it, and it has no
/// shape parameters left. The members after the model describe how it was fitted.
struct PersonalBody {
  BodyModel model;                       ///< the person, in rest pose
  std::vector<std::string> shape_names;  ///< [S] of the model it was made from
  Eigen::VectorXd shape;                 ///< [S] the values found
  Points displacements;                  ///< [V,3] metres, of the rest vertices off the shape space
  Eigen::VectorXd support;               ///< [V] frames whose scan met the vertex; 0: made up from
                                         ///< its neighbours or the other side of the body
};

/// A body as it is, without displacements: for tracking a person without a personal body. Throws
/// LogicError for a shape of another length; empty: neutral.
PersonalBody plain_person(const BodyModel& model, const Eigen::VectorXd& shape = {});

/// Throws DataError unless the model is valid and without shape parameters, and arrays have the
/// stated rows and finite numbers.
void check_personal_body(const PersonalBody& person, const std::string& file = "");

/// The arrays of an npz that reads as a body wherever bodies are read (body_archive.h), with
/// person_shape_names, person_shape, person_displacements, person_support. A body without these
/// reads as a plain person. Throws as body_arrays and body_of_arrays do.
std::map<std::string, Tensor> personal_body_arrays(const PersonalBody& person);
PersonalBody personal_body_of_arrays(const Npz& npz, const Limits& limits = {});

void write_personal_body(const std::filesystem::path& path, const PersonalBody& person);
PersonalBody read_personal_body(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
