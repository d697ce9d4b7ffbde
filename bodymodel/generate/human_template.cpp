// Prints bodymodel/human/human_template_data.cpp; scripts/human-template builds and runs it.

#include "bodymodel/human/human_template.h"

#include <iostream>

int main() {
  std::cout << atelier::human_template_source(atelier::make_human_template(),
                                              atelier::human_template_draft());
  return std::cout.flush() ? 0 : 1;
}
