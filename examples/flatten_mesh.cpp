// Lays a surface flat: finds seams and darts, flattens its panels and writes a sewing pattern.
//   flatten_mesh MESH OUT.svg
#include <exception>
#include <fstream>
#include <iostream>
#include <vector>

#include "core/io/mesh_file.h"
#include "core/topology.h"
#include "registration/drafting/draft_pattern.h"
#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/pattern_pieces.h"

int main(int count, char** arguments) {
  if (count != 3) {
    std::cerr << "usage: flatten_mesh MESH OUT.svg\n";
    return 2;
  }
  try {
    const atelier::Mesh mesh = atelier::read_mesh(arguments[1]);  // metres, Y up
    atelier::check_flattenable(mesh, arguments[1]);

    // One flag for each edge: where the surface is cut. None is given.
    const atelier::Topology topology = atelier::topology_of(mesh.faces, mesh.vertices.rows());
    const std::vector<char> given(static_cast<std::size_t>(topology.edges.rows()));
    atelier::FindSeamsOptions options;
    options.stretch = 0.05;  // of 99% of the area
    options.cuts = 20;
    const atelier::FoundSeams seams = find_seams(mesh, given, options);

    const atelier::FlatPattern pattern = flatten_surface(mesh, seams.cut);
    const atelier::FlatMeasures measures = measure_flat(mesh, pattern);
    std::cout << pattern.panel_names.size() << " panels, " << pattern.seams.size()
              << " seams, strain of 99% of the area below " << 100 * measures.strain_p99 << " %, "
              << measures.overlaps << " overlaps\n";
    std::ofstream(arguments[2]) << pattern_svg(lay_out_pattern(pattern), "example");
  } catch (const std::exception& error) {
    std::cerr << "flatten_mesh: " << error.what() << "\n";
    return 3;
  }
}
