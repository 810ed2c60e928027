"""A network and its demand from three CSV files, results as tables, a map that moves."""

from uxsim_geo import *

W = World(
    name="sf",
    deltan=5,
    tmax=7200,
    print_mode=1,
    save_mode=1,
    show_mode=0,
    random_seed=0,
)

W.load_scenario_from_csv(
    "dat/siouxfalls_nodes.csv", "dat/siouxfalls_links.csv", "dat/siouxfalls_demand.csv"
)

W.finalize_scenario()
W.exec_simulation()

W.analyzer.print_simple_stats()
W.analyzer.time_space_diagram_traj_links([["21-22", "22-15", "15-10", "10-9", "9-5"]])
W.analyzer.macroscopic_fundamental_diagram()
W.analyzer.network_average(detailed=0, network_font_size=0, figsize=(8, 8))
W.analyzer.network_anim(animation_speed_inverse=15, detailed=0, network_font_size=0)

print(W.analyzer.basic_to_pandas())
print(W.analyzer.od_to_pandas())
print(W.analyzer.mfd_to_pandas())
print(W.analyzer.link_to_pandas())
