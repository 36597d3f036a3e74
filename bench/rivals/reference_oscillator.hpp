// SPDX-License-Identifier: BSD-3-Clause
//
// Reference orbits of the dry friction oscillator, written by make_reference.cpp: Taylor series in
// quadruple precision, every orbit computed twice with different order and step. All start from
// (y, v) = (0, 0) at t = 0. omega is the double nearest to the decimal shown, T = 2 pi/omega in
// quadruple precision; the constants of the friction law are the exact decimals. Rounding those
// to double moves the final states by the amount given with each orbit.

#pragma once

#include <array>
#include <string_view>

namespace filippov::rivals {

struct ReferenceOrbit {
    double A, omega;
    int n_periods;
    int n_events;           // in all n_periods
    long double y, v;       // at t = n_periods T
    std::string_view kinds; // s: stick begins, 1: stick ends into S1, 2: into S2, u, d: crossings
    std::array<long double, 10> t_event;
};

// two computations differ by 3.3e-30, constants rounded to double by 2.6e-16
inline constexpr ReferenceOrbit reference_home{
    0.5,
    2.94,
    200,
    100,
    5.573365854277107760665082166e-02L,
    7.397537135751244343693252866e-01L,
    "s1s1s1s1s1",
    {3.085077007547330872492391634e-01L, 4.529157537905746398894891814e+00L,
     8.702623267407380274633910309e+00L, 1.298451754328800570301171828e+01L,
     1.717916014119902027810651961e+01L, 2.151466691158206490313672784e+01L,
     2.571491798168544062138655209e+01L, 3.005921214700741658089167435e+01L,
     3.426074518701911077199579620e+01L, 3.860687429779937966053609297e+01L}};

// two computations differ by 1.2e-30, constants rounded to double by 7.2e-17
inline constexpr ReferenceOrbit reference_5_172{
    5,
    1.72,
    50,
    151,
    -5.127479662890339445205118498e-01L,
    1.639541047245428786776799099e+00L,
    "us1us1us1u",
    {1.279241886212328742304679350e-01L, 6.003583261631544876222727794e-01L,
     1.253526236257710463449261700e+00L, 3.310285189789087145239047819e+00L,
     4.683239258872395359516788729e+00L, 4.789970518152062972307693845e+00L,
     7.033134630860448775792072520e+00L, 8.415055706396613230270451787e+00L,
     8.460173351263203562579485190e+00L, 1.067748356539487952895105142e+01L}};

// two computations differ by 1.8e-30, constants rounded to double by 8.0e-17
inline constexpr ReferenceOrbit reference_5_160{
    5,
    1.6,
    50,
    103,
    -8.546641649393818892976831218e-01L,
    2.002066128783519800719668804e+00L,
    "us1us1udud",
    {1.278387696863821293464062577e-01L, 6.605456240802777716319819029e-01L,
     1.333083998199052894910708674e+00L, 3.516128105628226813682107387e+00L,
     5.073844359892571145595703060e+00L, 5.102474308239701705544714529e+00L,
     7.508036054049620115028549985e+00L, 9.092282486643921163165906235e+00L,
     1.143401425342889168849924468e+01L, 1.301136505704513917176368987e+01L}};

} // namespace filippov::rivals
