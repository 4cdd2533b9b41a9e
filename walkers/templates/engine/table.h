// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* The table of a bridge: its capillary force and its resistances against the gap.

   A file has a table for each two surfaces that may meet; '#' begins a comment:

       bridge TYPE TYPE RADIUS RADIUS           atom types, radii in m; a wall's radius is "inf"
       [liquid VOLUME SHARE SHARE FILM FILM]    of beads whose liquid is conserved (README.md), m3
       [edge RESISTANCE]                        of moving edges (forces.h), N (s/m)^(2/3)
       range FORMATION RUPTURE SCALE OCTAVES CELLS
       GAP PULL NORMAL SLIDING COUPLING ROLLING

   Of the last line there are 3 CELLS (OCTAVES + 2) + 1, in the order of their gaps. Units are m,
   N, N s/m, N s/m, N s and N m s. COUPLING has its sign where i is the first of the two
   surfaces.

   Near contact the gap h is divided into octaves of 1 + h/SCALE, and each octave into CELLS
   cells (a power of two), up to m = SCALE (2^OCTAVES - 1). Beyond m there are 2 CELLS cells of
   equal steps in sqrt((RUPTURE - h)/(RUPTURE - m)), because the force may end with an infinite
   slope. Within a cell the columns are cubic polynomials through four rows: at the start of the
   cell, at 1/3 and 2/3 of it, and at the start of the next one. The last row is the rupture. The
   row at part t of cell c is at

       h = SCALE (2^k (1 + (c + t)/CELLS) - 1)                            in octave k, from 0
       h = m + (RUPTURE - m) (1 - (1 - (c + t)/(2 CELLS))^2)              beyond m

   The program writes these files (walkers/templates/bridge_tables.py). */
#ifndef BRIDGE_TABLE_H
#define BRIDGE_TABLE_H

#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace bridge {

enum { PULL, NORMAL, SLIDING, COUPLING, ROLLING, COLUMNS };

/* The words of a text, one after the other, without comments. */
class Words {
public:
  explicit Words(const char *const text) : at_(text) {}

  std::string next()
  {
    skip();
    const char *const begin = at_;
    while (*at_ && !std::isspace(static_cast<unsigned char>(*at_))) at_++;
    return std::string(begin, at_);
  }

  double number()
  {
    skip();
    char *end;
    const double value = std::strtod(at_, &end);  // takes "inf"
    if (end == at_ || (*end && !std::isspace(static_cast<unsigned char>(*end))))
      throw std::runtime_error("expected a number, not \"" + next() + "\"");
    if (std::isnan(value)) throw std::runtime_error("a number of a table is nan");
    at_ = end;
    return value;
  }

private:
  const char *at_;

  void skip()
  {
    while (std::isspace(static_cast<unsigned char>(*at_)) || *at_ == '#') {
      if (*at_ == '#')
        while (*at_ && *at_ != '\n') at_++;
      else at_++;
    }
  }
};

struct Cell {
  double coefficient[4][COLUMNS];
};

class Table {
public:
  int type[2];
  double radius[2], formation, rupture, contact[COLUMNS];
  double volume, share[2], film[2];  // m3; the volume is 0 where liquid is not conserved
  double edge;                       // N (s/m)^(2/3); 0 without moving edges

  /* The columns at a gap: a pointer to those at contact, or to place, where they are
     interpolated. */
  const double *at(const double gap, double *const place) const
  {
    if (gap <= 0.) return contact;
    double t;
    const Cell *cell;
    if (gap < middle) {
      // The exponent and the first bits of the mantissa of 1 + h/SCALE number the cells.
      const double x = 1. + gap * inverse_scale;
      uint64_t bits;
      std::memcpy(&bits, &x, sizeof(bits));
      cell = &near_[(bits >> shift) - first];
      t = (bits & within) * part;
    } else {
      const double y = (1. - std::sqrt(std::max(0., rupture - gap) * inverse_rest)) * far_.size();
      const size_t number = std::min(static_cast<size_t>(y), far_.size() - 1);
      cell = &far_[number];
      t = y - number;
    }
    for (int c = 0; c < COLUMNS; c++)
      place[c] =
        ((cell->coefficient[3][c] * t + cell->coefficient[2][c]) * t + cell->coefficient[1][c]) * t
        + cell->coefficient[0][c];
    return place;
  }

  bool joins(const int type_1, const int type_2, const double radius_1, const double radius_2) const
  {
    return (type_1 == type[0] && type_2 == type[1] && same(radius_1, radius[0])
            && same(radius_2, radius[1]))
        || (type_1 == type[1] && type_2 == type[0] && same(radius_1, radius[1])
            && same(radius_2, radius[0]));
  }

  bool begins_with(const double radius_1) const { return same(radius_1, radius[0]); }

  void read(Words &words)
  {
    type[0] = static_cast<int>(words.number());
    type[1] = static_cast<int>(words.number());
    radius[0] = words.number();
    radius[1] = words.number();
    std::string word = words.next();
    volume = 0.;
    if (word == "liquid") {
      for (double *const number : {&volume, &share[0], &share[1], &film[0], &film[1]})
        *number = words.number();
      if (!(volume > 0. && share[0] > 0. && share[1] >= 0. && film[0] > 0. && film[1] > 0.))
        throw std::runtime_error("the liquid of a table is not usable");
      word = words.next();
    }
    edge = 0.;
    if (word == "edge") {
      edge = words.number();
      if (!(edge >= 0. && std::isfinite(edge)))
        throw std::runtime_error("the edge of a table is not usable");
      word = words.next();
    }
    if (word != "range") throw std::runtime_error("a table lacks its range");
    formation = words.number();
    rupture = words.number();
    const double scale = words.number();
    const int octaves = static_cast<int>(words.number()), cells = static_cast<int>(words.number());
    int power = 0;
    while ((1 << power) < cells) power++;
    if (!(scale > 0. && rupture > 0. && formation >= 0. && formation <= rupture) || octaves < 0
        || octaves > 60 || cells != (1 << power) || power > 12)
      throw std::runtime_error("the range of a table is not usable");
    inverse_scale = 1. / scale;
    shift = 52 - power;
    within = (static_cast<uint64_t>(1) << shift) - 1;
    part = std::ldexp(1., -shift);
    first = static_cast<uint64_t>(1023) << power;
    middle = scale * (std::ldexp(1., octaves) - 1.);
    if (!(middle < rupture))
      throw std::runtime_error("the octaves of a table reach beyond the rupture");
    inverse_rest = 1. / (rupture - middle);
    std::vector<double> rows(COLUMNS * static_cast<size_t>(3 * cells * (octaves + 2) + 1));
    double before = -1.;
    for (size_t row = 0; row < rows.size(); row += COLUMNS) {
      const double gap = words.number();
      if (!(gap > before)) throw std::runtime_error("the gaps of a table do not grow");
      before = gap;
      for (int c = 0; c < COLUMNS; c++) rows[row + c] = words.number();
    }
    std::memcpy(contact, rows.data(), sizeof(contact));
    near_.clear();
    for (int octave = 0; octave < octaves; octave++)
      for (int number = 0; number < cells; number++)
        near_.push_back(cell(&rows[3 * COLUMNS * near_.size()]));
    far_.clear();
    for (int number = 0; number < 2 * cells; number++)
      far_.push_back(cell(&rows[3 * COLUMNS * (near_.size() + far_.size())]));
  }

private:
  double middle, inverse_scale, inverse_rest;
  int shift;
  uint64_t first, within;
  double part;
  std::vector<Cell> near_, far_;

  static bool same(const double a, const double b)
  {
    return a == b || std::fabs(a - b) <= 1e-9 * std::fabs(a);
  }

  static Cell cell(const double *const row)
  {
    Cell cubic;
    for (int c = 0; c < COLUMNS; c++) {
      const double f0 = row[c], f1 = row[c + COLUMNS];
      const double f2 = row[c + 2 * COLUMNS], f3 = row[c + 3 * COLUMNS];
      cubic.coefficient[0][c] = f0;
      cubic.coefficient[1][c] = -5.5 * f0 + 9. * f1 - 4.5 * f2 + f3;
      cubic.coefficient[2][c] = 9. * f0 - 22.5 * f1 + 18. * f2 - 4.5 * f3;
      cubic.coefficient[3][c] = -4.5 * f0 + 13.5 * f1 - 13.5 * f2 + 4.5 * f3;
    }
    return cubic;
  }
};

inline std::vector<Table> read_tables(const std::string &file)
{
  std::ifstream in(file.c_str());
  if (!in) throw std::runtime_error("cannot be read");
  std::ostringstream contents;
  contents << in.rdbuf();
  const std::string text = contents.str();
  Words words(text.c_str());
  std::vector<Table> tables;
  for (std::string word = words.next(); !word.empty(); word = words.next()) {
    if (word != "bridge") throw std::runtime_error("expected \"bridge\", not \"" + word + "\"");
    tables.push_back(Table());
    tables.back().read(words);
    if ((tables.back().volume > 0.) != (tables[0].volume > 0.))
      throw std::runtime_error("some tables have liquid, others none");
  }
  if (tables.empty()) throw std::runtime_error("holds no table");
  return tables;
}

}
#endif
