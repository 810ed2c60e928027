"""Two origins, a merge, a destination: everything by code, results printed and drawn."""

from uxsim_geo import *

W = World(
    name="",
    deltan=5,
    tmax=1200,
    print_mode=1,
    save_mode=1,
    show_mode=1,
    random_seed=0,
)

W.addNode("orig1", 0, 0)
W.addNode("orig2", 0, 2)
W.addNode("merge", 1, 1)
W.addNode("dest", 2, 1)
W.addLink("link1", "orig1", "merge", length=1000, free_flow_speed=20, jam_density=0.2)
W.addLink("link2", "orig2", "merge", length=1000, free_flow_speed=20, jam_density=0.2)
W.addLink("link3", "merge", "dest", length=1000, free_flow_speed=20, jam_density=0.2)
W.adddemand("orig1", "dest", 0, 1000, 0.45)
W.adddemand("orig2", "dest", 400, 1000, 0.6)

W.finalize_scenario()
W.exec_simulation()

W.analyzer.print_simple_stats()
W.analyzer.time_space_diagram_traj_links([["link1", "link3"], ["link2", "link3"]])
for t in list(range(0, W.TMAX, int(W.TMAX / 6))):
    W.analyzer.network(t, detailed=1, network_font_size=0)
W.analyzer.macroscopic_fundamental_diagram()
print(W.analyzer.basic_to_pandas())
