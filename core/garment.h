#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

/// Physical properties of a fabric. Stiffnesses are moduli of the membrane, independent of the
/// mesh.
struct Material {
  std::string name;
  double density = 0.15;       ///< kg/m2
  double stretch_warp = 1000;  ///< N/m, along the grain
  double stretch_weft = 1000;  ///< N/m, across the grain
  double shear = 100;          ///< N/m
  double bending = 1e-5;       ///< N m
  double damping = 0;          ///< s, stiffness-proportional (Rayleigh)
  double friction = 0.4;       ///< Coulomb coefficient
  double thickness = 0.001;    ///< m
};

OptionTable describe(Material& material);

/// Two sections of panel boundary that are sewn together, vertex by vertex.
struct Seam {
  std::string name;
  std::vector<int> a;  ///< vertices of one side, in order along it
  std::vector<int> b;  ///< vertices of the other side, same count, `b[i]` is sewn to `a[i]`
};

/// Attachment of a garment's vertex to a triangle of another mesh (the body), with which it moves.
struct Attachment {
  int vertex = 0;                                         ///< of the garment
  int triangle = 0;                                       ///< of the body
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();  ///< sums to 1
  double distance = 0;                                    ///< metres along the triangle's normal
};

/// One garment: a template in 3D, its rest shape, seams, material and how it moves with the body.
struct Garment {
  std::string name;
  Mesh mesh;                ///< the template; uvs are the texture atlas
  Points2 rest;             ///< [R,2] metres, flat rest shape of the panels, or empty
  Triangles rest_faces;     ///< [F,3] into rest, or empty: the rest shape is the mesh
  std::vector<int> panels;  ///< [F] panel of each face, or empty
  std::vector<std::string> panel_names;
  std::vector<Seam> seams;                   ///< vertices of `mesh`
  std::vector<std::vector<int>> boundaries;  ///< closed loops of vertices: neck, cuffs, hem, ...
  std::vector<std::string> boundary_names;
  std::vector<Attachment> attachments;
  Material material;
};

/// Throws DataError unless the mesh is valid and every other array agrees with it.
void check_garment(const Garment& garment, const std::string& file = "");

}  // namespace atelier
