// SPDX-License-Identifier: GPL-2.0-or-later
// Copyright (c) 2026, the granular-walkers developers
/* Reads the command "fix ID GROUP wall/bridge ...", whose syntax is in README.md. */
#ifndef BRIDGE_WALL_COMMAND_H
#define BRIDGE_WALL_COMMAND_H

#include "shaking.h"
#include "walls.h"

namespace {

/* The words of a command, one after the other. */
class CommandWords {
public:
  CommandWords(Force *const force, const int first, const int count, char **const words)
      : force_(force), at_(first), count_(count), words_(words)
  {
  }

  bool at_end() const { return at_ == count_; }

  char *next()
  {
    if (at_end()) throw std::runtime_error("the command ends early");
    return words_[at_++];
  }

  double number() { return force_->numeric(FLERR, next()); }

  Vec vector()
  {
    const double x = number(), y = number();
    return {x, y, number()};
  }

private:
  Force *force_;
  int at_, count_;
  char **words_;
};

/* Walls and shaking of a command. Throws std::runtime_error if the command cannot be used. */
class WallCommand {
public:
  int type;  // atom type of the walls
  std::vector<Wall> walls;
  Shaking shaking;

  WallCommand(CommandWords words, Atom *const atom) : type(0)
  {
    while (!words.at_end()) {
      const std::string keyword = words.next();
      if (!read_wall(keyword, words) && !read_shaking(keyword, words))
        throw std::runtime_error("unknown keyword " + keyword);
    }
    if (walls.empty()) throw std::runtime_error("expected a plane, a cylinder or facets");
    if (type < 1 || type > atom->ntypes)
      throw std::runtime_error("expected a type, of those of the box");
    if (shaking.in_lab_frame && !loads_file_.empty())
      throw std::runtime_error("loads need the walls' frame: expected frame walls");
    shaking.set_loads(loads_file_, atom->tag_max());
  }

private:
  std::string loads_file_;

  bool read_wall(const std::string &keyword, CommandWords &words)
  {
    if (keyword == "type") {
      type = static_cast<int>(words.number());
    } else if (keyword == "plane") {
      const Vec point = words.vector(), normal = words.vector();
      walls.push_back(Wall::plane(point, normal));
    } else if (keyword == "cylinder") {
      const double x = words.number(), y = words.number();
      walls.push_back(Wall::cylinder(x, y, words.number()));
    } else if (keyword == "facets") {
      Wall::read_facets(words.next(), walls);
    } else {
      return false;
    }
    return true;
  }

  bool read_shaking(const std::string &keyword, CommandWords &words)
  {
    if (keyword == "shaken") {
      const Vec amplitude = words.vector();
      const double frequency = 2. * M_PI * words.number();
      shaking.waves.push_back({amplitude, frequency, words.number(), Course()});
    } else if (keyword == "recorded") {
      const Vec amplitude = words.vector();
      shaking.waves.push_back({amplitude, 0., 0., Course(words.next())});
    } else if (keyword == "ramp") {
      shaking.ramp = Course(words.next());
    } else if (keyword == "gravity") {
      shaking.gravity = words.vector();
    } else if (keyword == "begin") {
      shaking.begin = static_cast<bigint>(words.number());
    } else if (keyword == "frame") {
      const std::string frame = words.next();
      shaking.in_lab_frame = frame == "lab";
      if (!shaking.in_lab_frame && frame != "walls")
        throw std::runtime_error("expected lab or walls, not " + frame);
    } else if (keyword == "loads") {
      loads_file_ = words.next();
    } else {
      return false;
    }
    return true;
  }
};

}
#endif
