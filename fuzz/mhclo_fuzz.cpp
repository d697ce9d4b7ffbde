#include "bodymodel/formats/mhclo.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(mhclo) {
  const atelier::Index base = 19'158;
  const atelier::Mhclo garment = atelier::read_mhclo(bytes, "mhclo", base);
  atelier::fitted_vertices(garment, atelier::Points::Ones(base, 3));
}
