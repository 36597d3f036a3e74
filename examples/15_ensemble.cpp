// SPDX-License-Identifier: BSD-3-Clause
// Many starts at once, on all threads, with progress, into a table that any program reads.
//
// Where do the starts of figure 4.15's plane end after ten periods of the drive? Lanes run eight of
// them at once or so; what comes of a start does not depend on the others.

#include <filippov/ensemble/ensemble.hpp>
#include <filippov/models/oscillator.hpp>

#include <cstdio>
#include <fstream>
#include <map>
#include <string>

using namespace filippov;

int main() {
    const models::Oscillator block;
    auto p = default_params<models::Oscillator>();
    p[0] = 1.5; // A
    p[1] = 1.8; // omega
    const double t_end = 10 * block.period(p);

    std::vector<Member<2, params_v<models::Oscillator>>> members;
    for (int i = 0; i < 40; ++i)
        for (int j = 0; j < 40; ++j)
            members.push_back({Vec<double, 2>(-4 + 0.2 * i, -3 + 0.1 * j), p, 0, t_end});

    int told = 0; // quarters
    Parallel how; // .threads = 0: as many as OpenMP takes
    how.progress = [&](std::size_t done, std::size_t total) {
        for (; told < int(4 * done / total); ++told)
            std::fprintf(stderr, "%zu of %zu\n", done, total);
    };
    const auto ends = ensemble(block, members, {.rtol = 1e-9, .atol = 1e-9}, how);

    std::ofstream table("ends.csv");
    table << "y0,v0,status,y,v,mode,events,slide_time\n";
    std::map<std::string, int> count;
    double slid = 0;
    for (std::size_t k = 0; k < members.size(); ++k) {
        const auto& o = ends.outcomes[k];
        table << members[k].x[0] << ',' << members[k].x[1] << ',' << name(o.status) << ',' << o.x[0]
              << ',' << o.x[1] << ',' << o.mode << ',' << o.events << ',' << o.slide_time << '\n';
        ++count[std::string(name(o.status))];
        slid += o.slide_time;
    }
    for (const auto& [status, n] : count)
        std::printf("%d starts: %s\n", n, status.c_str());
    std::printf("on the belt %.1f%% of the time; the table is ends.csv\n",
                100 * slid / (t_end * double(members.size())));
}
