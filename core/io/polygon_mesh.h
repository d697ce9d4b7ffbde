#pragma once

#include <string>
#include <vector>

#include "core/finding.h"
#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

/// Unit and axes of a mesh file. OBJ and PLY have no field for it; Atelier writes the comments
/// "units: m" and "up: y", and reads them back.
struct MeshConvention {
  double metres_per_unit = 0;  ///< 0: the file does not say
  char up = '\0';              ///< 'x', 'y' or 'z'; '\0': the file does not say
};

/// The unit and up axis of files that do not say theirs. A unit or axis that is not set counts as
/// out of its choices: give defaults first.
OptionTable describe(MeshConvention& convention);

/// A mesh as a file of polygons holds it: n-gons, names, attributes per corner; positions in the
/// file's own unit and axes. `triangulated` makes a Mesh of it.
struct PolygonMesh {
  Points vertices;                   ///< [V,3]
  Colors colors;                     ///< [V,3] linear RGB in [0,1], or empty
  Points vertex_normals;             ///< [V,3] unit length, or empty
  std::vector<std::uint8_t> labels;  ///< [V] or empty
  Eigen::VectorXf confidence;        ///< [V] or empty

  Points2 uvs;     ///< [T,2] v up
  Points normals;  ///< [N,3] as in the file, for `corner_normals`

  std::vector<int> polygon_starts = {0};  ///< [P+1] first corner of each polygon, and their count
  std::vector<int> corner_vertices;       ///< [C] into vertices, counter-clockwise from outside
  std::vector<int> corner_uvs;            ///< [C] into uvs, -1 for none; or empty
  std::vector<int> corner_normals;        ///< [C] into normals, -1 for none; or empty

  std::vector<std::string> group_names;
  std::vector<std::string> object_names;
  std::vector<std::string> material_names;
  std::vector<std::string> material_files;
  std::vector<int> polygon_groups;     ///< [P] into group_names, -1 for none; or empty
  std::vector<int> polygon_objects;    ///< [P] into object_names, -1 for none; or empty
  std::vector<int> polygon_materials;  ///< [P] into material_names, -1 for none; or empty

  MeshConvention convention;
  std::vector<Finding> findings;  ///< what the reader skipped
};

/// Number of polygons.
inline Index polygon_count(const PolygonMesh& mesh) {
  return static_cast<Index>(mesh.polygon_starts.size()) - 1;
}

/// Throws LogicError unless sizes agree, every index is in range and polygons have 3 corners or
/// more.
void check_polygons(const PolygonMesh& mesh);

/// The polygons as triangles: polygon p of n corners gives n - 2 triangles in a row, in order of p.
/// A convex polygon becomes a fan from its first corner, another is cut by its ears in the plane of
/// its Newell normal (Meisters 1975); where it has none left (it crosses itself), the rest is a
/// fan. Texture coordinates are kept if every corner has one; normals if the file has them per
/// vertex or every vertex is used with one normal only. Cost: n^2 per concave polygon. Throws as
/// `check_polygons`.
Mesh triangulated(const PolygonMesh& polygons);

/// A triangle mesh as polygons, with "units: m" and "up: y".
PolygonMesh polygons_of(const Mesh& mesh);

/// The mesh in metres with Y up. Where the file does not say, `otherwise` counts.
Mesh in_metres_y_up(Mesh mesh, const MeshConvention& said, const MeshConvention& otherwise);

/// Metres of a unit's name: "m", "dm", "cm", "mm", "in", "ft" and their long names, in any case and
/// with blanks, full stops, quotes or brackets around them ("MM", "Millimeters", "[cm]", "in."),
/// long ones cut behind four letters or more ("mete"); 0 if unknown.
double metres_of_unit(const std::string& name);

/// "units: m" and "up: y" as lines behind `prefix`; nothing for what is not said.
std::string convention_comments(const MeshConvention& convention, const std::string& prefix);

/// Gives every row length 1; rows within 1e-6 of it keep their bits. False if some row has no
/// direction (the rows are then of no use).
bool make_unit_rows(Points& normals);

/// Reads "units: cm" and "up: z" out of a comment; others are ignored.
void read_convention(const std::string& comment, MeshConvention& convention);

}  // namespace atelier
