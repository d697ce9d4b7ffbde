#include "registration/minimum_cut.h"

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>

#include "core/error.h"

namespace atelier {

std::vector<char> minimum_cut(const std::vector<double>& cost_first,
                              const std::vector<double>& cost_second,
                              const std::vector<CutLink>& links) {
  using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
  using Graph = boost::adjacency_list<
      boost::vecS, boost::vecS, boost::directedS,
      boost::property<boost::vertex_index_t, long,
                      boost::property<boost::vertex_color_t, boost::default_color_type,
                                      boost::property<boost::vertex_distance_t, long,
                                                      boost::property<boost::vertex_predecessor_t,
                                                                      Traits::edge_descriptor>>>>,
      boost::property<
          boost::edge_capacity_t, double,
          boost::property<boost::edge_residual_capacity_t, double,
                          boost::property<boost::edge_reverse_t, Traits::edge_descriptor>>>>;
  const std::size_t count = cost_first.size();
  ATELIER_CHECK(cost_second.size() == count, "costs of both sides");
  Graph graph(count + 2);
  auto capacity = boost::get(boost::edge_capacity, graph);
  auto reverse = boost::get(boost::edge_reverse, graph);
  const auto add = [&](std::size_t a, std::size_t b, double there, double back) {
    ATELIER_CHECK(there >= 0 && back >= 0, "costs of 0 or more");
    const auto forth = boost::add_edge(a, b, graph).first;
    const auto other = boost::add_edge(b, a, graph).first;
    capacity[forth] = there;
    capacity[other] = back;
    reverse[forth] = other;
    reverse[other] = forth;
  };
  for (std::size_t i = 0; i < count; ++i) {
    add(count, i, cost_second[i], 0);
    add(i, count + 1, cost_first[i], 0);
  }
  for (const CutLink& link : links) {
    ATELIER_CHECK(link.a < count && link.b < count && link.a != link.b, "links between nodes");
    add(link.a, link.b, link.cost, link.cost);
  }
  boost::boykov_kolmogorov_max_flow(graph, count, count + 1);
  const auto color = boost::get(boost::vertex_color, graph);
  std::vector<char> first(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    first[i] = color[i] == boost::black_color ? 1 : 0;
  }
  return first;
}

}  // namespace atelier
