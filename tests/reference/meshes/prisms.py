"""A quarter of a tube in prisms of Gmsh, of first order and of second (with nodes on edges only, and on quadrilaterals too), with Gmsh's own volumes, areas of
faces and shape functions, and the places of the nodes in VTK. Needs gmsh and vtk; writes prism6.msh, prism15.msh, prism18.msh and prisms.json."""
import gmsh, json, numpy as np, vtk
out = {"gmsh": gmsh.__version__, "elements": {}, "meshes": {}}
gmsh.initialize(); gmsh.option.setNumber("General.Terminal", 0)
at = [[0.0,0.0,0.0],[0.21,0.34,0.17],[0.6,0.3,-0.8],[0.1,0.05,0.9]]
for t, name in ((6,"Prism6"),(18,"Prism15"),(13,"Prism18")):
    _,_,_,n,places,_ = gmsh.model.mesh.getElementProperties(t)
    _, v, _ = gmsh.model.mesh.getBasisFunctions(t, sum(at,[]), "Lagrange")
    _, g, _ = gmsh.model.mesh.getBasisFunctions(t, sum(at,[]), "GradLagrange")
    out["elements"][name] = {"number": t, "places": np.reshape(places,(n,3)).tolist(), "at": at,
        "values": np.reshape(v,(len(at),n)).tolist(), "gradients": np.reshape(g,(len(at),n,3)).tolist()}
for name, order, incomplete in (("prism6",1,0),("prism15",2,1),("prism18",2,0)):
    gmsh.clear(); gmsh.model.add(name)
    g = gmsh.model.geo; h = 0.45
    c = g.addPoint(0,0,0,h); p=[g.addPoint(*x,h) for x in ((0.5,0,0),(1,0,0),(0,1,0),(0,0.5,0))]
    l = [g.addLine(p[0],p[1]), g.addCircleArc(p[1],c,p[2]), g.addLine(p[2],p[3]), g.addCircleArc(p[3],c,p[0])]
    s = g.addPlaneSurface([g.addCurveLoop(l)])
    e = g.extrude([(2,s)],0,0,0.6,[2],[],True)
    g.synchronize()
    m = gmsh.model
    for tag,(who,nm) in enumerate((([s],"zmin"),([e[0][1]],"zmax"),([e[2][1]],"ymin"),([e[3][1]],"outer"),([e[4][1]],"xmin"),([e[5][1]],"inner")),1):
        m.addPhysicalGroup(2,who,tag,nm)
    m.addPhysicalGroup(3,[e[1][1]],10,"body")
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    gmsh.option.setNumber("Mesh.SecondOrderLinear", 0)
    m.mesh.generate(3); m.mesh.setOrder(order)
    types,tags,nodes = m.mesh.getElements(3)
    assert len(types)==1, types
    vol = m.mesh.getElementQualities(tags[0],"volume")
    # faces by Gmsh's own Jacobians of the surface elements: area of every group
    areas={}
    for dim,tag in m.getPhysicalGroups(2):
        a=0.0
        for ent in m.getEntitiesForPhysicalGroup(dim,tag):
            for t,tg,_ in zip(*m.mesh.getElements(2,ent)):
                loc,w=m.mesh.getIntegrationPoints(t,"Gauss8")
                _,det,_=m.mesh.getJacobians(t,loc,ent)
                a+=float(np.sum(np.reshape(det,(len(tg),-1))*w))
        areas[m.getPhysicalName(dim,tag)]=a
    loc,w=m.mesh.getIntegrationPoints(int(types[0]),"Gauss8")
    _,det,_=m.mesh.getJacobians(int(types[0]),loc)
    v2=np.reshape(det,(len(tags[0]),-1))@w
    print(name,len(tags[0]),len(m.mesh.getNodes()[0]),vol.sum(),v2.sum(),np.pi/4*.75*.6,areas)
    out["meshes"][name]={"cells":len(tags[0]),"nodes":len(set(nodes[0])),"volumes":{str(t):float(v) for t,v in zip(tags[0],v2)},"areas":areas}
    gmsh.option.setNumber("Mesh.MshFileVersion",4.1); gmsh.write(name+".msh")
    # an independent Jacobian test: which faces have triangles
out["vtk"] = {"version": vtk.vtkVersion().GetVTKVersion()}
for name, cell in (("Prism6", vtk.vtkWedge()), ("Prism15", vtk.vtkQuadraticWedge()), ("Prism18", vtk.vtkBiQuadraticQuadraticWedge())):
    c = cell.GetParametricCoords(); n = cell.GetNumberOfPoints()
    out["vtk"][name] = {"number": cell.GetCellType(), "places": [list(c[3*i:3*i+3]) for i in range(n)]}
json.dump(out, open("prisms.json", "w"), indent=None)
