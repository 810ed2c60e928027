"""Opens a results file's own project in QGIS and tells as JSON what is there; draws it too.

Run by the system's python3, which has QGIS, apart from the environment of the tests:

    python3 qgis_look.py RESULTS.gpkg FOLDER
"""

import json
import os
import re
import sys
from pathlib import Path

os.environ["QT_QPA_PLATFORM"] = "offscreen"

from qgis.core import (
    QgsApplication,
    QgsExpression,
    QgsExpressionContext,
    QgsExpressionContextUtils,
    QgsFeatureRequest,
    QgsInterval,
    QgsLayoutExporter,
    QgsMapRendererSequentialJob,
    QgsMapSettings,
    QgsProject,
    QgsRenderContext,
    QgsTemporalNavigationObject,
    QgsVectorLayer,
    QgsVectorLayerTemporalContext,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QSize, Qt
from qgis.PyQt.QtGui import QColor

STATES = "uxsim_geo_link_states"  # of a run; those of a study have the scenario's name behind


def layer_told(layer):
    """What a layer is like."""
    renderer = layer.renderer()
    symbols = renderer.legendSymbolItems() if renderer is not None else []
    return {
        "valid": layer.isValid(),
        "rows": layer.featureCount(),
        "crs": layer.crs().authid(),
        "geometry": QgsWkbTypes.displayString(layer.wkbType()),
        "renderer": renderer.type() if renderer is not None else None,
        "classes": [item.label() for item in symbols],
        "faults": faults(layer),
        "tips": [
            tip(layer, feature) for feature in layer.getFeatures(QgsFeatureRequest().setLimit(2))
        ],
        "styles": sorted(layer.styleManager().styles()),
        "style": layer.styleManager().currentStyle(),
        "temporal": layer.temporalProperties().isActive(),
        "aliases": {field.name(): field.alias() for field in layer.fields()},
        "attribution": layer.attribution(),
    }


def alone(package, name):
    """A layer as it comes without the project: its classes, and the styles in the file."""
    layer = QgsVectorLayer(f"{package}|layername={name}", name, "ogr")
    number, _, names, _, _ = layer.listStylesInDatabase()
    classes = len(layer.renderer().legendSymbolItems()) if layer.isSpatial() else 0
    return {"valid": layer.isValid(), "classes": classes, "styles": sorted(names[:number])}


def faults(layer):
    """Expressions of all styles that do not work on the first feature, and why."""
    found, manager = [], layer.styleManager()
    features = list(layer.getFeatures(QgsFeatureRequest().setLimit(1)))
    current = manager.currentStyle()
    for style in manager.styles() if layer.isSpatial() else []:
        manager.setCurrentStyle(style)
        renderer = layer.renderer()
        texts = [renderer.legendClassificationAttribute()]
        if renderer.type() == "RuleRenderer":
            texts += [rule.filterExpression() for rule in renderer.rootRule().descendants()]
        texts += [clause.expression().expression() for clause in renderer.orderBy().list()]
        for symbol in renderer.symbols(QgsRenderContext()):
            for part in symbol.symbolLayers():
                properties = part.dataDefinedProperties()
                texts += [
                    properties.property(key).asExpression() for key in properties.propertyKeys()
                ]
        for text in filter(None, texts):
            expression, context = QgsExpression(text), context_of(layer)
            for feature in features:
                context.setFeature(feature)
                expression.evaluate(context)
            if expression.hasParserError() or expression.hasEvalError():
                found.append(
                    [style, text, expression.parserErrorString(), expression.evalErrorString()]
                )
    manager.setCurrentStyle(current)
    return found


def context_of(layer):
    """Where expressions of a layer are evaluated."""
    return QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))


def tip(layer, feature):
    """What shows when the pointer rests on a feature."""
    context = context_of(layer)
    context.setFeature(feature)
    return QgsExpression.replaceExpressionText(layer.mapTipTemplate(), context)


def rows_at(layer, range_):
    """Links that a temporal map shows in a range of time, and when their states begin."""
    context = QgsVectorLayerTemporalContext()
    context.setLayer(layer)
    text = layer.temporalProperties().createFilterString(context, range_)
    request = QgsFeatureRequest().setFilterExpression(text)
    found = [
        (f["link_id"], f["begin"].toUTC().toString(Qt.ISODate)) for f in layer.getFeatures(request)
    ]
    return sorted(found)


def frames(project):
    """The moments of the slider, as the Temporal Controller steps: first, middle and last."""
    settings = project.timeSettings()
    slider = QgsTemporalNavigationObject()
    slider.setTemporalExtents(settings.temporalRange())
    slider.setFrameDuration(QgsInterval(settings.timeStep(), settings.timeStepUnit()))
    number = slider.totalFrameCount()
    picked = sorted({0, number // 2, number - 1})
    return [slider.dateTimeRangeForFrameNumber(frame) for frame in picked]


def draw(project, theme, time, path):
    """A theme as a picture; returns how many different colours it holds."""
    collection = project.mapThemeCollection()
    settings = QgsMapSettings()
    settings.setLayers(collection.mapThemeVisibleLayers(theme))
    settings.setLayerStyleOverrides(collection.mapThemeStyleOverrides(theme))
    settings.setDestinationCrs(project.crs())
    settings.setExtent(project.viewSettings().defaultViewExtent())
    settings.setOutputSize(QSize(1400, 1000))
    settings.setOutputDpi(110)
    settings.setBackgroundColor(QColor("white"))
    settings.setTransformContext(project.transformContext())
    if time is not None:
        settings.setIsTemporal(True)
        settings.setTemporalRange(time)
    job = QgsMapRendererSequentialJob(settings)
    job.start()
    job.waitForFinished()
    image = job.renderedImage()
    image.save(path)
    seen = {image.pixel(x, y) for x in range(0, 1400, 25) for y in range(1000)}
    return {"errors": [error.message for error in job.errors()], "colours": len(seen)}


def look(package, folder):
    """Open the project of the package, and return all that a test wants to know."""
    project = QgsProject.instance()
    storage = QgsApplication.projectStorageRegistry().projectStorageFromType("geopackage")
    (name,) = storage.listProjects("geopackage:" + package)
    opened = project.read(f"geopackage:{package}?projectName={name}")
    layers = project.mapLayers()
    told = {
        "opened": opened,
        "title": project.title(),
        "crs": project.crs().authid(),
        "visible": [n.layerId() for n in project.layerTreeRoot().findLayers() if n.isVisible()],
        "layers": {key: layer_told(layer) for key, layer in layers.items()},
        "alone": {
            key: alone(package, layer.source().partition("|layername=")[2])
            for key, layer in layers.items()
        },
        "mode": project.readNumEntry("TemporalControllerWidget", "/NavigationMode")[0],
    }
    times = []
    visible = [found.layerId() for found in project.layerTreeRoot().findLayers()]
    states = next((key for key in visible if key.startswith(STATES)), None)
    if states is not None:
        times = frames(project)
        told["frames"] = [rows_at(layers[states], time) for time in times]
    told["themes"] = {}
    for theme in project.mapThemeCollection().mapThemes():
        shown = times[len(times) // 2] if theme.startswith("in time") and times else None
        path = str(folder / (re.sub(r"\W+", "_", theme) + ".png"))
        told["themes"][theme] = draw(project, theme, shown, path)
    told["layouts"] = {}
    for layout in project.layoutManager().printLayouts():
        settings = QgsLayoutExporter.ImageExportSettings()
        settings.dpi = 150
        settings.exportMetadata = False
        settings.generateWorldFile = False
        path = str(folder / (layout.name().replace(" ", "_") + ".png"))
        status = QgsLayoutExporter(layout).exportToImage(path, settings)
        texts = [item.currentText() for item in layout.items() if hasattr(item, "currentText")]
        told["layouts"][layout.name()] = {"status": int(status), "texts": texts}
    return told


if __name__ == "__main__":
    application = QgsApplication([], False)
    application.initQgis()
    sys.stdout.write(json.dumps(look(sys.argv[1], Path(sys.argv[2]))))
    sys.stdout.flush()
    os._exit(0)  # QGIS may crash when Python takes it down
